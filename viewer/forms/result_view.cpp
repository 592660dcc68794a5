// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/result_view.h"

#include <algorithm>

#include <QApplication>
#include <QClipboard>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QKeyEvent>
#include <QLabel>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QStackedWidget>
#include <QTableView>
#include <QVBoxLayout>

#include "kernel/literal.h"
#include "kernel/units.h"
#include "viewer/forms/form_context.h"
#include "viewer/forms/plot_view.h"
#include "viewer/forms/result_picture.h"
#include "viewer/forms/result_table.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/choice_field.h"
#include "viewer/widgets/field.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kLongestText = 20'000;     // bytes of a value shown as text
constexpr QSize kMostPicturePixels(3840, 2160);  // of a picture as it is kept

const char* const kModes[] = {"plot", "table", "picture", "value"};

std::shared_ptr<PlotData> plot_of(const ResultTable& table) {
  auto out = std::make_shared<PlotData>();
  if (table.columns.empty()) return out;
  const auto unit = [&](std::size_t c) { return c < table.units.size() ? table.units[c] : ""; };
  const std::size_t count = table.row_count();
  out->x_name = table.columns[0];
  out->x_unit = unit(0);
  out->x.reserve(count);
  for (std::size_t r = 0; r < count; ++r) out->x.push_back(table.number(r, 0));
  for (std::size_t c = 1; c < table.columns.size(); ++c) {
    PlotData::Column column{table.columns[c], unit(c), {}};
    column.values.reserve(count);
    for (std::size_t r = 0; r < count; ++r) column.values.push_back(table.number(r, c));
    out->columns.push_back(std::move(column));
  }
  return out;
}

}  // namespace

ResultView::ResultView(ioci::Client& client, QWidget* parent) : QWidget(parent), client_(client) {
  const Theme& t = theme();
  setObjectName("result");
  setAccessibleName("Result");
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  tabs_ = new QWidget(this);
  tabs_->setObjectName("result.tabs");
  tabs_->setAccessibleName("Forms of the result");
  tabs_->setProperty("ground", "header");
  tabs_->setAttribute(Qt::WA_StyledBackground);
  auto* row = new QHBoxLayout(tabs_);
  row->setContentsMargins(t.px(4), t.px(2), t.px(4), t.px(2));
  row->setSpacing(t.px(4));
  const char* const names[] = {"Plot", "Table", "Picture", "Value"};
  for (std::size_t i = 0; i < 4; ++i) {
    auto* b = new QPushButton(names[i], tabs_);
    style_as_segment(b);
    b->setObjectName(QString("result.as_") + kModes[i]);
    b->setAccessibleName(QString("Result as ") + kModes[i]);
    b->setToolTip(b->accessibleName());
    QObject::connect(b, &QPushButton::clicked, this, [this, i] { show_mode(kModes[i]); });
    row->addWidget(b);
    buttons_.push_back(b);
  }
  row->addStretch();
  units_ = new ChoiceField(tabs_);
  units_->setFixedWidth(t.px(140));
  units_->set_may_be_empty(false);
  units_->describe("Columns", "Which columns of the plot are shown, by their unit.", {},
                   "result.units");
  units_->on_change = [this](Field::Stage) { show_units(); };
  row->addWidget(units_);
  column->addWidget(tabs_);
  stack_ = new QStackedWidget(this);
  plot_ = new PlotView(stack_);
  plot_->setObjectName("result.plot");
  table_ = new QTableView(stack_);
  table_->setObjectName("result.table");
  table_->setAccessibleName("Result as a table");
  table_->setToolTip("Ctrl+C copies the selected cells; a click on a heading sorts by it.");
  table_->installEventFilter(this);
  constexpr int kMeasuredRows = 100;  // for widths of columns
  table_->horizontalHeader()->setResizeContentsPrecision(kMeasuredRows);
  table_->horizontalHeader()->setSortIndicatorClearable(true);
  table_->verticalHeader()->setSectionResizeMode(QHeaderView::Fixed);
  table_->verticalHeader()->setDefaultSectionSize(t.row);
  table_->horizontalHeader()->setStretchLastSection(true);
  table_->setShowGrid(false);
  picture_ = new QLabel(stack_);
  picture_->setObjectName("result.picture");
  picture_->setAccessibleName("Result as a picture");
  picture_->setToolTip("The picture that the command made");
  picture_->setAlignment(Qt::AlignCenter);
  picture_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Ignored);
  text_ = new QPlainTextEdit(stack_);
  text_->setObjectName("result.value");
  text_->setAccessibleName("Result as Lua");
  text_->setToolTip("The value as Lua");
  text_->setReadOnly(true);
  use_font(*text_, &Theme::code);
  text_->setTabChangesFocus(true);
  stack_->addWidget(plot_);
  stack_->addWidget(table_);
  stack_->addWidget(picture_);
  stack_->addWidget(text_);
  column->addWidget(stack_, 1);
  set_modes({});
}

std::string ResultView::shown_mode() const {
  return modes_.empty() ? std::string() : kModes[stack_->currentIndex()];
}

void ResultView::set_modes(std::vector<std::string> modes) {
  modes_ = std::move(modes);
  for (std::size_t i = 0; i < 4; ++i)
    buttons_[i]->setVisible(std::find(modes_.begin(), modes_.end(), kModes[i]) != modes_.end());
  if (!modes_.empty()) show_mode(modes_.front());
}

void ResultView::set_plot(std::shared_ptr<const PlotData> plotted) {
  // Panels lower than this cannot be read: then one unit is shown at first.
  constexpr std::size_t kMostPanels = 3;
  std::vector<std::string> units;
  for (const PlotData::Column& c : plotted->columns)
    if (std::find(units.begin(), units.end(), c.unit) == units.end()) units.push_back(c.unit);
  std::vector<FieldChoice> choices{{Value("all"), "all columns", {}, {}}};
  for (const std::string& unit : units) {
    QStringList names;
    for (const PlotData::Column& c : plotted->columns)
      if (c.unit == unit) names << qt(c.name);
    choices.push_back({Value("=" + unit),
                       unit.empty() ? QString("no unit") : unit_text(unit),
                       names.join(", "),
                       {}});
  }
  units_->set_choices(std::move(choices));
  units_->set_value(Value(units.size() <= kMostPanels ? "all" : "=" + units.front()));
  plot_->show_data(std::move(plotted));
  show_units();
}

void ResultView::show_units() {
  const auto chosen = units_->value();
  const PlotData* plotted = plot_->data();
  for (std::size_t i = 0; plotted && i < plotted->columns.size(); ++i)
    plot_->set_shown(
        i, !chosen || *chosen == Value("all") || *chosen == Value("=" + plotted->columns[i].unit));
}

void ResultView::show_mode(const std::string& mode) {
  for (std::size_t i = 0; i < 4; ++i) {
    buttons_[i]->setChecked(mode == kModes[i]);
    if (mode == kModes[i]) stack_->setCurrentIndex(static_cast<int>(i));
  }
  units_->setVisible(mode == "plot");
}

void ResultView::clear() {
  ++asked_;
  set_modes({});
  text_->clear();
  pixmap_ = {};
}

void ResultView::show_table(ResultTable table) {
  QAbstractItemModel* before = table_->model();
  table_->setSortingEnabled(false);
  table_->setModel(new ResultModel(std::move(table), table_));
  delete before;
  table_->horizontalHeader()->setSortIndicator(-1, Qt::AscendingOrder);
  table_->setSortingEnabled(true);
  table_->resizeColumnsToContents();
}

void ResultView::show_result(const Value& result, const std::string& unit) {
  ++asked_;
  if (const Handle* h = result.as_handle(); h && h->kind == "recording") return show_recording(*h);
  std::vector<std::string> modes;
  if (const auto picture = picture_of(result); picture && show_picture(*picture))
    modes.emplace_back("picture");
  if (const std::string* s = result.as_string()) {
    text_->setPlainText(qt(s->substr(0, kLongestText)));
  } else {
    std::string beginning = beginning_of_literal(result, kLongestText);
    if (beginning.size() > kLongestText) beginning += " …";
    QString shown = result.is_nil() ? QString("no value") : qt(beginning);
    if (result.is_number() && !unit.empty()) shown += " " + unit_text(unit);
    text_->setPlainText(shown);
  }
  ResultTable table = table_of(result);
  if (!table.columns.empty()) {
    if (table.is_curve) {
      set_plot(plot_of(table));
      modes.insert(modes.begin(), "plot");
    }
    modes.emplace_back("table");
    show_table(std::move(table));
  }
  modes.emplace_back("value");
  set_modes(std::move(modes));
}

void ResultView::show_recording(const Handle& recording) {
  const int number = asked_;
  text_->setPlainText(qt(recording.kind + "#" + std::to_string(recording.number)));
  set_modes({"value"});
  ask(client_, "recording.columns", Map{{"id", recording}}, this,
      [this, number, recording](const Result<Value>& r) {
        if (number != asked_ || !r.ok() || !r->as_list()) return;
        ResultTable table;
        List names;
        for (const Value& each : *r->as_list())
          if (const Map* m = each.as_map()) {
            const Value* name = m->find("name");
            const Value* unit = m->find("unit");
            table.columns.push_back(name ? name->text() : "");
            table.units.push_back(unit && unit->as_string() ? *unit->as_string() : "");
            names.emplace_back(table.columns.back());
          }
        ask(client_, "recording.values", Map{{"id", recording}, {"columns", names}}, this,
            [this, number, table](const Result<Value>& values) {
              if (number != asked_ || !values.ok() || !values->as_array()) return;
              ResultTable whole = table;
              whole.numbers = *values->as_array();
              std::vector<std::string> modes;
              if (whole.rises() && whole.columns.size() > 1) {
                set_plot(plot_of(whole));
                modes.emplace_back("plot");
              }
              show_table(std::move(whole));
              modes.emplace_back("table");
              modes.emplace_back("value");
              set_modes(std::move(modes));
            });
      });
  ask(client_, "recording.overview", Map{{"id", recording}}, this,
      [this, number](const Result<Value>& r) {
        if (number == asked_ && r.ok() && r->as_string()) text_->setPlainText(qt(*r->as_string()));
      });
}

bool ResultView::show_picture(const ResultPicture& picture) {
  pixmap_ = QPixmap::fromImage(draw_picture(picture, kMostPicturePixels));
  if (pixmap_.isNull()) return false;
  fit_picture();
  return true;
}

void ResultView::fit_picture() {
  if (pixmap_.isNull()) return;
  const double ratio = devicePixelRatioF();
  QPixmap fitted =
      pixmap_.scaled(stack_->size() * ratio, Qt::KeepAspectRatio, Qt::SmoothTransformation);
  fitted.setDevicePixelRatio(ratio);
  picture_->setPixmap(fitted);
}

bool ResultView::eventFilter(QObject* object, QEvent* event) {
  if (object == table_ && event->type() == QEvent::KeyPress &&
      static_cast<QKeyEvent*>(event)->matches(QKeySequence::Copy)) {
    const auto* model = static_cast<const ResultModel*>(table_->model());
    if (model && table_->selectionModel())
      QApplication::clipboard()->setText(model->text_of(table_->selectionModel()->selection()));
    return true;
  }
  return QWidget::eventFilter(object, event);
}

void ResultView::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange)
    for (QPushButton* b : buttons_) style_as_segment(b);
  QWidget::changeEvent(event);
}

void ResultView::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fit_picture();
}

}  // namespace robomosp::viewer
