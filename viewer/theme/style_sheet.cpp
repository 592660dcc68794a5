// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdlib>
#include <memory>

#include <QFile>
#include <QPixmap>
#include <QRegularExpression>
#include <QTemporaryDir>

#include "viewer/theme/icons.h"
#include "viewer/theme/style_images.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

/// `@name` is replaced by a colour of the theme, `@image_name` by the file of an icon, `4px` by
/// four pixels at its zoom.
constexpr const char* kSheet = R"(
QMainWindow, QMainWindow > QStackedWidget { background: @window; }
QMainWindow::separator { background: @line; width: 1px; height: 1px; }
QMainWindow::separator:hover { background: @accent; }
QToolTip { background: @header; color: @text; border: 1px solid @field_line; padding: 4px; }

QMenuBar { background: @header; spacing: 0px; }
QMenuBar::item { background: transparent; padding: 8px 8px; }
QMenuBar::item:selected { background: @hover; }
QMenuBar::item:pressed { background: @selection; }
QMenu { background: @header; border: 1px solid @field_line; padding: 4px 0px; }
QMenu::item { padding: 4px 24px 4px 28px; background: transparent; }
QMenu::item:selected { background: @selection; }
QMenu::item:disabled { color: @disabled; }
QMenu::separator { height: 1px; background: @line; margin: 4px 0px; }
QMenu::icon { left: 8px; }
QMenu::indicator { left: 8px; width: 12px; height: 12px; }

QStatusBar { background: @header; color: @text_dim; border-top: 1px solid @line; }
QStatusBar::item { border: 0px; }
QStatusBar QLabel { color: @text_dim; padding: 0px 4px; }

QDockWidget { color: @text; }
QDockWidget > QWidget { border: 0px; }

QTabBar { background: @window; qproperty-drawBase: 0; }
QTabBar::tab { background: @header; color: @text_dim; padding: 5px 12px; border: 0px;
  border-top: 2px solid transparent; border-right: 1px solid @line; }
QTabBar::tab:selected { background: @panel; color: @text; border-top: 2px solid @accent; }
QTabBar::tab:hover:!selected { background: @hover; color: @text; }
QTabBar::tab:focus { color: @accent; }
QTabWidget::pane { border: 0px; background: @window; }
QTabWidget::tab-bar { left: 0px; }
QTabBar QToolButton { background: @header; border: 0px; border-radius: 0px; }

QTreeView, QListView, QTableView { background: @panel; color: @text; border: 0px; outline: 0px;
  alternate-background-color: @panel; selection-background-color: @selection; }
QTreeView, QListView, QTableView { border: 1px solid transparent; }
QTreeView:focus, QListView:focus, QTableView:focus { border: 1px solid @accent; }
QTreeView::item, QListView::item { height: 24px; border: 0px; }
QTreeView::item:hover, QListView::item:hover { background: @hover; }
QTreeView::item:selected, QListView::item:selected, QTableView::item:selected {
  background: @selection; color: @text; }
QTreeView::item:selected:!active, QListView::item:selected:!active,
QTableView::item:selected:!active { background: @selection_idle; color: @text; }
QTreeView::branch { background: transparent; }
QTreeView::branch:selected { background: @selection; }
QTreeView::branch:selected:!active { background: @selection_idle; }
QHeaderView { background: @header; }
QHeaderView::section { background: @header; color: @text_dim; border: 0px;
  border-right: 1px solid @line; border-bottom: 1px solid @line; padding: 3px 6px; }
QTableView { gridline-color: @line; }
QTableCornerButton::section { background: @header; border: 0px; }

QLineEdit, QPlainTextEdit, QTextEdit, QSpinBox, QDoubleSpinBox { background: @field; color: @text;
  border: 1px solid @field_line; border-radius: 3px; padding: 1px 5px;
  selection-background-color: @accent_fill; selection-color: @on_accent; }
QLineEdit:hover, QSpinBox:hover, QDoubleSpinBox:hover { border-color: @text_quiet; }
QLineEdit:focus, QPlainTextEdit:focus, QTextEdit:focus, QSpinBox:focus, QDoubleSpinBox:focus {
  border: 1px solid @accent; }
QLineEdit:disabled, QPlainTextEdit:disabled { color: @disabled; border-color: @line; }
QLineEdit[fault="true"] { background: @fault_ground; border-color: @fault; }
QPlainTextEdit[flat="true"], QTextEdit[flat="true"] { border: 0px; border-radius: 0px;
  padding: 0px; }

QPushButton { background: @header; color: @text; border: 1px solid @field_line; border-radius: 3px;
  padding: 3px 11px; min-height: 16px; }
QPushButton:hover { background: @hover; }
QPushButton:pressed { background: @field; }
QPushButton:focus { border: 2px solid @accent; padding: 2px 10px; }
QPushButton:disabled { color: @disabled; border-color: @line; }
QPushButton[filled="true"] { background: @accent_fill; color: @on_accent;
  border-color: @accent_fill; }
QPushButton[filled="true"]:hover { background: @accent; }
QPushButton[filled="true"]:focus { border: 2px solid @text; }
QPushButton[link="true"] { background: transparent; border: 1px solid transparent; color: @accent;
  padding: 1px 4px; text-align: left; }
QPushButton[link="true"]:hover { text-decoration: underline; }
QPushButton[link="true"]:focus { border: 1px solid @accent; }

QToolButton { background: transparent; color: @text_dim; border: 1px solid transparent;
  border-radius: 3px; padding: 3px; }
QToolButton:hover { background: @hover; color: @text; }
QToolButton:checked { background: @selection; color: @accent; }
QToolButton:pressed { background: @field; }
QToolButton:focus { border: 1px solid @accent; }
QToolButton:disabled { color: @disabled; }
QToolButton::menu-indicator { image: none; }
QToolButton#qt_toolbar_ext_button { padding: 0px; border: 0px; }
QToolButton[workspace="true"] { color: @text_dim; border: 0px; border-radius: 0px;
  border-bottom: 2px solid transparent; padding: 6px 12px 4px 12px; }
QToolButton[workspace="true"]:checked { background: transparent; color: @text; font-weight: 600;
  border-bottom: 2px solid @accent; }
QToolButton[workspace="true"]:hover { background: @hover; }
QToolButton[workspace="true"]:focus { color: @accent; }

QComboBox { background: @field; color: @text; border: 1px solid @field_line; border-radius: 3px;
  padding: 1px 6px; min-height: 18px; }
QComboBox:hover { border-color: @text_quiet; }
QComboBox:focus { border-color: @accent; }
QComboBox::drop-down { border: 0px; width: 18px; }
QComboBox::down-arrow { image: url(@image_chevron_down); width: 12px; height: 12px; }
QComboBox::down-arrow:disabled { image: none; }
QComboBox:disabled { color: @disabled; border-color: @line; }
QComboBox QAbstractItemView { background: @header; border: 1px solid @field_line;
  selection-background-color: @selection; selection-color: @text; }

QCheckBox, QRadioButton { color: @text; spacing: 6px; }
QCheckBox:disabled, QRadioButton:disabled { color: @disabled; }
QCheckBox::indicator { width: 13px; height: 13px; border: 1px solid @field_line;
  border-radius: 3px; background: @field; }
QCheckBox::indicator:hover, QCheckBox::indicator:focus { border-color: @accent; }
QCheckBox::indicator:checked { background: @accent_fill; border-color: @accent_fill;
  image: url(@image_ok); }
QCheckBox::indicator:disabled { border-color: @line; background: @panel; }
QLabel { color: @text; }
QLabel[dim="true"] { color: @text_dim; }
QLabel[quiet="true"] { color: @text_quiet; }
QLabel[fault="true"] { color: @fault; }
QLabel[warning="true"] { color: @warn; }
QLabel:disabled { color: @disabled; }

QProgressBar { background: @field; border: 0px; border-radius: 2px; max-height: 4px;
  min-height: 4px; }
QProgressBar::chunk { background: @accent; border-radius: 2px; }

QSlider::groove:horizontal { height: 4px; border-radius: 2px; background: @field_line; }
QSlider::sub-page:horizontal { height: 4px; border-radius: 2px; background: @accent_fill; }
QSlider::sub-page:horizontal:disabled { background: @line; }
QSlider::handle:horizontal { width: 12px; height: 12px; margin: -4px 0px; border-radius: 6px;
  background: @text_dim; }
QSlider::handle:horizontal:hover { background: @text; }
QSlider::handle:horizontal:focus { background: @accent; }
QSlider::handle:horizontal:disabled { background: @disabled; }

QScrollBar { background: transparent; border: 0px; margin: 0px; }
QScrollBar:vertical { width: 10px; }
QScrollBar:horizontal { height: 10px; }
QScrollBar::handle { background: @field_line; border-radius: 3px; margin: 2px; }
QScrollBar::handle:vertical { min-height: 24px; }
QScrollBar::handle:horizontal { min-width: 24px; }
QScrollBar::handle:hover { background: @text_quiet; }
QScrollBar::add-line, QScrollBar::sub-line { width: 0px; height: 0px; }
QScrollBar::add-page, QScrollBar::sub-page { background: transparent; }
QAbstractScrollArea::corner { background: transparent; }
QSplitter::handle { background: @line; }
QSplitter::handle:horizontal { width: 1px; }
QSplitter::handle:vertical { height: 1px; }

*[popup="true"] { background: @panel; border: 1px solid @field_line; }
*[ground="window"] { background: @window; }
*[ground="panel"] { background: @panel; }
*[ground="header"] { background: @header; }
*[ground="field"] { background: @field; }
*[card="true"] { background: @panel; border: 1px solid @line; border-radius: 3px; }
*[card="true"]:hover { border-color: @field_line; }
*[card="true"]:focus { border: 2px solid @accent; }
)";

QColor colour_named(const Theme& t, const QString& name) {
  const struct {
    const char* name;
    const QColor& colour;
  } all[] = {{"window", t.window},
             {"panel", t.panel},
             {"header", t.header},
             {"field", t.field},
             {"hover", t.hover},
             {"line", t.line},
             {"field_line", t.field_line},
             {"text", t.text},
             {"text_dim", t.text_dim},
             {"text_quiet", t.text_quiet},
             {"disabled", t.disabled},
             {"accent", t.accent},
             {"accent_fill", t.accent_fill},
             {"on_accent", t.on_accent},
             {"selection", t.selection},
             {"selection_idle", t.selection_idle},
             {"warn", t.warn},
             {"fault", t.fault},
             {"fault_ground", t.fault_ground}};
  for (const auto& each : all)
    if (name == QLatin1String(each.name)) return each.colour;
  return {};
}

/// Of images; null before the first one.
std::unique_ptr<QTemporaryDir>& image_folder() {
  static std::unique_ptr<QTemporaryDir> folder;
  return folder;
}

/// Style sheets take images from files only. These are there until the process ends; without them,
/// such as on a full disk, widgets have no such mark.
QString image_file(const Theme& t, const QString& name) {
  auto& folder = image_folder();
  if (!folder) folder = std::make_unique<QTemporaryDir>();
  constexpr int kSize = 16, kFine = 3;  // [px], and for screens with small pixels
  const QColor& colour = name == QLatin1String("ok") ? t.on_accent : t.text_dim;
  const int size = kFine * t.px(kSize);
  const QString file =
      folder->filePath(QString("%1-%2-%3.png").arg(name, colour.name().mid(1)).arg(size));
  if (!QFile::exists(file)) (void)icon_pixmap(name.toStdString(), colour, size, 1).save(file);
  return file;
}

}  // namespace

void remove_style_images() { image_folder().reset(); }

QString style_sheet(const Theme& t) {
  const QString sheet = QString::fromLatin1(kSheet);
  static const QRegularExpression token("@([a-z_]+)|(?<![\\w#.])(-?[0-9]+)px");
  QString out;
  out.reserve(sheet.size() + sheet.size() / 4);
  qsizetype done = 0;
  for (auto it = token.globalMatch(sheet); it.hasNext();) {
    const QRegularExpressionMatch m = it.next();
    out += QStringView(sheet).mid(done, m.capturedStart() - done);
    done = m.capturedEnd();
    if (m.capturedLength(1) > 0) {
      const QString name = m.captured(1);
      constexpr int kPrefix = 6;  // image_
      out += name.startsWith("image_") ? "\"" + image_file(t, name.mid(kPrefix)) + "\""
                                       : colour_named(t, name).name();
    } else {
      const int length = m.captured(2).toInt();
      // Lines stay as thin as the design's at every zoom up to 150 %.
      out += QString::number(std::abs(length) <= 1 && t.zoom < 1.75 ? length : t.px(length)) + "px";
    }
  }
  out += QStringView(sheet).mid(done);
  return out;
}

}  // namespace robomosp::viewer
