// SPDX-License-Identifier: GPL-3.0-or-later
// Entries of the menu View for several views, views with names, and stereo pictures.
#include <array>
#include <cmath>
#include <optional>

#include <QActionGroup>
#include <QInputDialog>
#include <QMenu>
#include <QStatusBar>
#include <QWidgetAction>

#include "viewer/desktop/main_window.h"
#include "viewer/desktop/values.h"
#include "viewer/scene/linear.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_field.h"

namespace robomosp::viewer {
namespace {

struct StereoEntry {
  const char *name, *text;
  Stereo mode;
};
constexpr std::array<StereoEntry, 4> kStereoEntries{
    {{"stereo_none", "&None", Stereo::none},
     {"stereo_anaglyph", "&Anaglyph (red and cyan glasses)", Stereo::anaglyph},
     {"stereo_side_by_side", "&Side by side", Stereo::side_by_side},
     {"stereo_interlaced", "&Interlaced rows", Stereo::interlaced}}};

QString record_of(const ViewTab& view) { return shown(view.what().kind) + " " + view.name(); }

/// Eye, target and projection as seven words.
QString text_of_camera(const OrbitCamera& camera) {
  QStringList words;
  for (const Vec3& p : {camera.eye(), camera.target()})
    for (const double v : p) words += QString::number(v, 'g', 12);
  words += camera.perspective() ? "perspective" : "orthographic";
  return words.join(' ');
}

/// Nothing if the text is none of a camera.
std::optional<OrbitCamera> camera_from_text(const QString& text) {
  const QStringList words = text.split(' ');
  if (words.size() != 7) return {};
  std::array<double, 6> v{};
  for (int i = 0; i < 6; ++i) {
    bool is_number = false;
    v[static_cast<std::size_t>(i)] = words[i].toDouble(&is_number);
    if (!is_number) return {};
  }
  const Vec3 eye{v[0], v[1], v[2]}, target{v[3], v[4], v[5]};
  if (!is_finite(eye) || !is_finite(target) || !(norm(eye - target) > 0)) return {};
  OrbitCamera camera;
  camera.set_perspective(words[6] == "perspective");
  camera.look_from(eye, target);
  return camera;
}

/// A row of a menu: a name and a number.
NumberField* add_number(QMenu* menu, const char* name, const QString& title, const QString& tip) {
  NumberFormat format;
  format.unit = "m";
  format.shown = "mm";
  format.min = 0;
  auto* field = new NumberField(format);
  field->setObjectName(name);
  field->setAccessibleName(title);
  field->setToolTip(tip);
  field->set_prefix(title);
  field->setMinimumWidth(theme().px(240));
  auto* entry = new QWidgetAction(menu);
  entry->setObjectName(QString(name) + "_entry");
  entry->setText(title);
  entry->setDefaultWidget(field);
  menu->addAction(entry);
  return field;
}

}  // namespace

void MainWindow::make_views_menu(QMenu* menu) {
  actions_.add(
      menu, {"four_views", "Four &views", "four_views", "Shift+V", "", true},
      [this](bool on) { change_look([on](ViewLook& look) { look.has_four_views = on; }); });
  QMenu* own = menu->addMenu("Named views");
  own->setObjectName("user_views_menu");
  own->setToolTipsVisible(true);
  actions_.add(own, {"save_view", "&Save this view...", "save", "Ctrl+Shift+V", "", false, false},
               [this](bool) {
                 ViewTab* view = current_view();
                 if (!view) return;
                 auto* dialog = new QInputDialog(this);
                 dialog->setObjectName("view_name_dialog");
                 dialog->setAttribute(Qt::WA_DeleteOnClose);
                 dialog->setWindowTitle("Save this view");
                 dialog->setLabelText("Name of the view");
                 dialog->setTextValue(
                     QString("View %1").arg(settings_.user_views(record_of(*view)).size() + 1));
                 connect(dialog, &QInputDialog::textValueSelected, this,
                         [this](const QString& name) { save_user_view(name); });
                 dialog->open();
               });
  connect(own, &QMenu::aboutToShow, this, [this, own] { fill_user_views(*own); });
}

void MainWindow::save_user_view(const QString& name) {
  ViewTab* view = current_view();
  if (!view || name.trimmed().isEmpty()) return;
  auto views = settings_.user_views(record_of(*view));
  views[name.trimmed()] = text_of_camera(view->display().camera());
  settings_.set_user_views(record_of(*view), views);
  statusBar()->showMessage("Saved the view " + name.trimmed(), 5000);
}

void MainWindow::fill_user_views(QMenu& menu) {
  // All but the first entry were made for another view.
  const auto old = menu.actions();
  for (qsizetype i = 1; i < old.size(); ++i) {
    menu.removeAction(old[i]);
    old[i]->deleteLater();
  }
  ViewTab* view = current_view();
  if (!view) return;
  const QString record = record_of(*view);
  const auto views = settings_.user_views(record);
  menu.addSeparator();
  if (views.isEmpty())
    menu.addAction("No views saved for this " + shown(view->what().kind))->setEnabled(false);
  int number = 0;
  for (auto i = views.begin(); i != views.end(); ++i) {
    QMenu* each = menu.addMenu(i.key());
    each->setObjectName(QString("user_view_%1").arg(++number));
    each->menuAction()->setObjectName(QString("user_view_%1_entry").arg(number));
    const QString name = i.key(), camera = i.value();
    QAction* go = each->addAction("&Go to it");
    go->setObjectName(QString("user_view_%1_go").arg(number));
    connect(go, &QAction::triggered, this, [this, camera] {
      ViewTab* now = current_view();
      const auto wanted = camera_from_text(camera);
      if (now && wanted) now->display().set_camera(*wanted);
    });
    QAction* rename = each->addAction("&Rename...");
    rename->setObjectName(QString("user_view_%1_rename").arg(number));
    connect(rename, &QAction::triggered, this, [this, record, name] {
      auto* dialog = new QInputDialog(this);
      dialog->setObjectName("view_name_dialog");
      dialog->setAttribute(Qt::WA_DeleteOnClose);
      dialog->setWindowTitle("Rename the view");
      dialog->setLabelText("Name of the view");
      dialog->setTextValue(name);
      connect(dialog, &QInputDialog::textValueSelected, this, [this, record, name](QString to) {
        to = to.trimmed();
        auto all = settings_.user_views(record);
        if (to.isEmpty() || to == name || !all.contains(name)) return;
        all[to] = all.take(name);
        settings_.set_user_views(record, all);
      });
      dialog->open();
    });
    QAction* remove = each->addAction("&Delete");
    remove->setObjectName(QString("user_view_%1_delete").arg(number));
    connect(remove, &QAction::triggered, this, [this, record, name] {
      auto all = settings_.user_views(record);
      all.remove(name);
      settings_.set_user_views(record, all);
    });
  }
}

void MainWindow::make_stereo_menu(QMenu* menu) {
  QMenu* stereo = menu->addMenu("Stereo &picture");
  stereo->setObjectName("stereo_menu");
  stereo->setToolTipsVisible(true);
  auto* group = new QActionGroup(this);
  for (const StereoEntry& each : kStereoEntries)
    group->addAction(actions_.add(
        stereo, {each.name, each.text, "", "", "", true}, [this, mode = each.mode](bool) {
          change_look([mode](ViewLook& look) { look.stereo.mode = mode; });
        }));
  QAction* quad = actions_.add(stereo, {"stereo_quad", "&Quad buffers", "", "", "", false}, {});
  quad->setEnabled(false);
  quad->setToolTip(
      "Qt 6.4 draws views into textures, which have no second pair of buffers. Choose "
      "another kind.\n" +
      command_of(*quad));
  stereo->addSeparator();
  NumberField* eyes =
      add_number(stereo, "stereo_eye_distance", "Distance of the eyes",
                 "Distance between the two cameras; 0 = a thirtieth of the convergence");
  NumberField* convergence =
      add_number(stereo, "stereo_convergence", "Convergence",
                 "Distance of what lies in the plane of the screen; 0 = the middle of the view");
  eyes->on_change = [this, eyes](Field::Stage) {
    if (const auto v = eyes->number())
      change_look([v](ViewLook& look) { look.stereo.eye_distance = *v; });
  };
  convergence->on_change = [this, convergence](Field::Stage) {
    if (const auto v = convergence->number())
      change_look([v](ViewLook& look) { look.stereo.convergence = *v; });
  };
  connect(stereo, &QMenu::aboutToShow, this, [this, eyes, convergence] {
    const ViewTab* view = current_view();
    const StereoSettings now = view ? view->look().stereo : StereoSettings();
    eyes->set_value(Value(now.eye_distance));
    convergence->set_value(Value(now.convergence));
  });
}

void MainWindow::check_views(const ViewLook& look, bool has_view) {
  actions_.enable("four_views", has_view);
  actions_.check("four_views", look.has_four_views);
  actions_.enable("save_view", has_view);
  for (const StereoEntry& each : kStereoEntries) {
    actions_.enable(each.name, has_view);
    actions_.check(each.name, look.stereo.mode == each.mode);
  }
}

}  // namespace robomosp::viewer
