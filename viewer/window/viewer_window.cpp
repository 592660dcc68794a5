// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/viewer_window.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include <QAction>
#include <QActionGroup>
#include <QApplication>
#include <QComboBox>
#include <QDockWidget>
#include <QFileDialog>
#include <QHeaderView>
#include <QLabel>
#include <QMenuBar>
#include <QMessageBox>
#include <QPixmap>
#include <QSignalBlocker>
#include <QSlider>
#include <QStatusBar>
#include <QToolBar>
#include <QTreeWidget>

#include "viewer/scene/linear.h"
#include "viewer/scene/playback.h"
#include "viewer/window/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kSliderSteps = 10000;
constexpr int kTickMs = 16;
constexpr int kNoAxis = -1;
constexpr double kSectionStep = 0.05;  ///< of the box of all items
constexpr std::array<double, 6> kSpeeds{0.1, 0.25, 0.5, 1, 2, 4};
constexpr const char* kHelp =
    "Drag: orbit   Shift+drag or middle button: move   Wheel: zoom   F: fit   1-7: views   "
    "Space: play";

QIcon swatch(const Colour& c) {
  QPixmap pixmap(12, 12);
  pixmap.fill(QColor::fromRgbF(std::clamp(c.r, 0.0F, 1.0F), std::clamp(c.g, 0.0F, 1.0F),
                               std::clamp(c.b, 0.0F, 1.0F)));
  return QIcon(pixmap);
}

/// Least and greatest coordinates of all items, {} without any.
std::array<Vec3, 2> box_of(const Frame& frame) {
  constexpr double kFar = std::numeric_limits<double>::max();
  std::array<Vec3, 2> box{Vec3{kFar, kFar, kFar}, Vec3{-kFar, -kFar, -kFar}};
  for (const Item& item : frame.items) {
    if (!item.mesh) continue;
    const auto& p = item.mesh->positions;
    for (std::size_t v = 0; v + 2 < p.size(); v += 3) {
      const Vec3 at =
          transform(item.pose, {static_cast<double>(p[v]), static_cast<double>(p[v + 1]),
                                static_cast<double>(p[v + 2])});
      for (std::size_t i = 0; i < 3; ++i) {
        box[0][i] = std::min(box[0][i], at[i]);
        box[1][i] = std::max(box[1][i], at[i]);
      }
    }
  }
  return box[0][0] <= box[1][0] ? box : std::array<Vec3, 2>{};
}

QString seconds(double t) { return QString::number(t, 'f', 2) + " s"; }

}  // namespace

ViewerWindow::ViewerWindow(std::unique_ptr<Display> display) : display_(display.release()) {
  setObjectName("viewer_window");
  setDockOptions(AllowTabbedDocks | AllowNestedDocks | AnimatedDocks);
  setCentralWidget(display_);
  display_->on_pick = [this](const std::optional<Pick>& hit) { show_pick(hit); };
  make_objects_dock();
  make_actions();
  make_timeline();
  statusBar()->setObjectName("status");
  renderer_ = new QLabel(display_->renderer_name());
  renderer_->setObjectName("renderer");
  renderer_->setEnabled(false);
  statusBar()->addPermanentWidget(renderer_);
  statusBar()->showMessage(kHelp);
  connect(&ticker_, &QTimer::timeout, this, [this] { tick(); });
  ticker_.setInterval(kTickMs);
  ticker_.setTimerType(Qt::PreciseTimer);
  set_playback({});
}

ViewerWindow::~ViewerWindow() = default;

void ViewerWindow::make_actions() {
  menuBar()->setObjectName("menu_bar");
  bar_ = addToolBar("Main");
  bar_->setObjectName("main_bar");
  bar_->setMovable(false);
  bar_->setIconSize(QSize(20, 20));

  QMenu* file = menuBar()->addMenu("&File");
  file->setObjectName("file_menu");
  QAction* save = file->addAction(icon_of(Symbol::picture), "&Save picture...");
  save->setObjectName("save_picture");
  save->setShortcut(QKeySequence("Ctrl+Shift+S"));
  save->setToolTip("Save the picture as a PNG file of best quality (Ctrl+Shift+S)");
  connect(save, &QAction::triggered, this, [this] { save_picture(); });
  file->addSeparator();
  QAction* quit = file->addAction("&Quit");
  quit->setObjectName("quit");
  quit->setShortcut(QKeySequence::Quit);
  connect(quit, &QAction::triggered, this, &QWidget::close);

  QMenu* view = menuBar()->addMenu("&View");
  view->setObjectName("view_menu");
  make_view_actions(view, bar_);
  bar_->addAction(save);
  bar_->addSeparator();
}

void ViewerWindow::make_view_actions(QMenu* menu, QToolBar* bar) {
  QAction* fit = menu->addAction(icon_of(Symbol::fit), "&Fit all");
  fit->setObjectName("fit");
  fit->setShortcut(QKeySequence("F"));
  fit->setToolTip("Show everything (F)");
  connect(fit, &QAction::triggered, this, [this] { display_->fit(); });
  bar->addAction(fit);

  struct Named {
    const char *name, *text;
    Camera::View view;
  };
  constexpr std::array<Named, 7> kViews{{{"view_isometric", "&Isometric", Camera::View::isometric},
                                         {"view_front", "F&ront", Camera::View::front},
                                         {"view_back", "&Back", Camera::View::back},
                                         {"view_left", "&Left", Camera::View::left},
                                         {"view_right", "Ri&ght", Camera::View::right},
                                         {"view_top", "&Top", Camera::View::top},
                                         {"view_bottom", "B&ottom", Camera::View::bottom}}};
  menu->addSeparator();
  for (std::size_t i = 0; i < kViews.size(); ++i) {
    QAction* action = menu->addAction(kViews[i].text);
    action->setObjectName(kViews[i].name);
    action->setShortcut(QKeySequence(QString::number(i + 1)));
    connect(action, &QAction::triggered, this, [this, v = kViews[i].view] { display_->look(v); });
    if (i > 0) continue;
    action->setIcon(icon_of(Symbol::isometric));
    action->setToolTip("Three-quarter view (1)");
    bar->addAction(action);
  }
  menu->addSeparator();
  perspective_ = menu->addAction(icon_of(Symbol::perspective), "&Perspective");
  perspective_->setObjectName("perspective");
  perspective_->setCheckable(true);
  perspective_->setChecked(true);
  perspective_->setShortcut(QKeySequence("P"));
  perspective_->setToolTip("Perspective or parallel projection (P)");
  connect(perspective_, &QAction::toggled, this,
          [this](bool on) { display_->set_perspective(on); });
  bar->addAction(perspective_);
  menu->addSeparator();
  make_style_menu(menu->addMenu("Drawing &style"));
  make_section_menu(menu->addMenu("Se&ction plane"));
  make_ellipsoid_actions(menu->addMenu("&Manipulability"));
  menu->addSeparator();
  add_toggle(menu, "show_grid", "&Grid", &Frame::grid);
  add_toggle(menu, "show_axes", "World &axes", &Frame::world_axes);
  add_toggle(menu, "show_edges", "Feature &edges", &Frame::feature_edges);
  QAction* refine = menu->addAction("Fine &picture when still");
  refine->setObjectName("refine");
  refine->setCheckable(true);
  connect(refine, &QAction::toggled, this, [this](bool on) { display_->set_refining(on); });
  menu->addSeparator();
  menu->addAction(findChild<QDockWidget*>("objects_dock")->toggleViewAction());
}

void ViewerWindow::make_style_menu(QMenu* menu) {
  menu->setObjectName("style_menu");
  styles_ = new QActionGroup(this);
  struct Named {
    const char *name, *text, *key;
    Style style;
  };
  constexpr std::array<Named, 4> kStyles{
      {{"style_smooth", "&Smooth", "Shift+1", Style::smooth},
       {"style_flat", "&Flat", "Shift+2", Style::flat},
       {"style_wireframe", "&Wireframe", "Shift+3", Style::wireframe},
       {"style_hidden_line", "&Hidden line", "Shift+4", Style::hidden_line}}};
  for (const Named& s : kStyles) {
    QAction* action = menu->addAction(s.text);
    action->setObjectName(s.name);
    action->setCheckable(true);
    action->setShortcut(QKeySequence(s.key));
    action->setData(static_cast<int>(s.style));
    styles_->addAction(action);
  }
  connect(styles_, &QActionGroup::triggered, this, [this](const QAction* chosen) {
    is_style_chosen_ = true;
    frame_.style = static_cast<Style>(chosen->data().toInt());
    hidden_edges_->setEnabled(frame_.style == Style::hidden_line);
    show_frame();
  });
  menu->addSeparator();
  hidden_edges_ =
      add_toggle(menu, "show_hidden_edges", "Hidden edges &dashed", &Frame::hidden_edges);
}

void ViewerWindow::make_section_menu(QMenu* menu) {
  menu->setObjectName("section_menu");
  sections_ = new QActionGroup(this);
  struct Named {
    const char *name, *text;
    int axis;
  };
  constexpr std::array<Named, 4> kAxes{{{"section_none", "&None", kNoAxis},
                                        {"section_x", "Across &x", 0},
                                        {"section_y", "Across &y", 1},
                                        {"section_z", "Across &z", 2}}};
  for (const Named& a : kAxes) {
    QAction* action = menu->addAction(a.text);
    action->setObjectName(a.name);
    action->setCheckable(true);
    action->setData(a.axis);
    sections_->addAction(action);
  }
  connect(sections_, &QActionGroup::triggered, this, [this] {
    section_share_ = 0.5;
    choose_section();
  });
  menu->addSeparator();
  turn_section_ = menu->addAction("Keep the &other side");
  turn_section_->setObjectName("section_turn");
  turn_section_->setCheckable(true);
  connect(turn_section_, &QAction::toggled, this, [this] { choose_section(); });
  for (const auto& [name, text, key, by] :
       {std::tuple{"section_forward", "Move &forward", "Ctrl+Up", kSectionStep},
        std::tuple{"section_back", "Move &back", "Ctrl+Down", -kSectionStep}}) {
    QAction* action = menu->addAction(text);
    action->setObjectName(name);
    action->setShortcut(QKeySequence(key));
    connect(action, &QAction::triggered, this, [this, by = by] { move_section(by); });
  }
}

void ViewerWindow::make_ellipsoid_actions(QMenu* menu) {
  menu->setObjectName("ellipsoid_menu");
  const auto add = [&](const char* name, const char* text, const char* key, const char* tip,
                       const char* layer) {
    QAction* action = menu->addAction(text);
    action->setObjectName(name);
    action->setCheckable(true);
    action->setEnabled(false);
    action->setShortcut(QKeySequence(key));
    action->setStatusTip(tip);
    connect(action, &QAction::toggled, this, [this, layer](bool on) {
      if (show_layer_) show_layer_(layer, on);
    });
    return action;
  };
  velocity_ellipsoid_ =
      add("show_velocity_ellipsoid", "&Velocity ellipsoid", "Ctrl+E",
          "Velocities of the tool for joint speeds of length 1", "velocity_ellipsoids");
  force_ellipsoid_ = add("show_force_ellipsoid", "&Force ellipsoid", "Ctrl+Shift+E",
                         "Forces of the tool for joint torques of length 1", "force_ellipsoids");
}

void ViewerWindow::set_layers(std::function<void(const std::string& layer, bool is_shown)> show) {
  show_layer_ = std::move(show);
  for (QAction* action : {velocity_ellipsoid_, force_ellipsoid_})
    action->setEnabled(static_cast<bool>(show_layer_));
}

void ViewerWindow::check_layer(const std::string& layer) {
  if (layer == "velocity_ellipsoids") velocity_ellipsoid_->setChecked(show_layer_ != nullptr);
  if (layer == "force_ellipsoids") force_ellipsoid_->setChecked(show_layer_ != nullptr);
}

void ViewerWindow::show_frame() { display_->set_frame(frame_); }

void ViewerWindow::choose_section() {
  is_section_chosen_ = true;
  const QAction* chosen = sections_->checkedAction();
  const int axis = chosen ? chosen->data().toInt() : kNoAxis;
  frame_.section.reset();
  if (axis != kNoAxis) {
    const auto k = static_cast<std::size_t>(axis);
    const auto [low, high] = box_of(frame_);
    Section section;
    section.normal = {};
    section.normal[k] = turn_section_->isChecked() ? -1 : 1;
    section.point[k] = low[k] + section_share_ * (high[k] - low[k]);
    frame_.section = section;
    statusBar()->showMessage("Section at " + QString(QChar('x' + axis)) + " = " +
                             QString::number(section.point[k], 'f', 3) + " m");
  } else {
    statusBar()->showMessage(kHelp);
  }
  show_style_and_section();
  show_frame();
}

void ViewerWindow::move_section(double share) {
  if (!frame_.section) return;
  section_share_ = std::clamp(section_share_ + share, 0.0, 1.0);
  choose_section();
}

void ViewerWindow::show_style_and_section() {
  for (QAction* action : styles_->actions())
    action->setChecked(action->data().toInt() == static_cast<int>(frame_.style));
  hidden_edges_->setEnabled(frame_.style == Style::hidden_line);
  const bool is_cut = frame_.section.has_value();
  if (!is_cut) sections_->actions().front()->setChecked(true);
  turn_section_->setEnabled(is_cut);
  for (const char* name : {"section_forward", "section_back"})
    findChild<QAction*>(name)->setEnabled(is_cut);
}

QAction* ViewerWindow::add_toggle(QMenu* menu, const QString& name, const QString& text,
                                  bool Frame::*flag) {
  QAction* action = menu->addAction(text);
  action->setObjectName(name);
  action->setCheckable(true);
  action->setChecked(frame_.*flag);
  connect(action, &QAction::toggled, this, [this, flag](bool on) {
    if (frame_.*flag == on) return;
    frame_.*flag = on;
    show_frame();
  });
  return action;
}

void ViewerWindow::make_objects_dock() {
  auto* dock = new QDockWidget("Objects", this);
  dock->setObjectName("objects_dock");
  objects_ = new QTreeWidget(dock);
  objects_->setObjectName("objects");
  objects_->setHeaderLabels({"Object"});
  objects_->setRootIsDecorated(false);
  objects_->header()->setStretchLastSection(true);
  dock->setWidget(objects_);
  addDockWidget(Qt::LeftDockWidgetArea, dock);
  resizeDocks({dock}, {190}, Qt::Horizontal);
  connect(objects_, &QTreeWidget::itemSelectionChanged, this, [this] {
    std::vector<std::uint64_t> ids;
    for (const QTreeWidgetItem* row : objects_->selectedItems())
      ids.push_back(row->data(0, Qt::UserRole).toULongLong());
    display_->select(ids);
  });
}

void ViewerWindow::make_timeline() {
  to_start_ = bar_->addAction(icon_of(Symbol::to_start), "To the start");
  to_start_->setObjectName("to_start");
  to_start_->setShortcut(QKeySequence("Home"));
  connect(to_start_, &QAction::triggered, this,
          [this] { set_time(playback_->times.empty() ? 0 : playback_->times.front()); });
  play_ = bar_->addAction(icon_of(Symbol::play), "Play");
  play_->setObjectName("play");
  play_->setShortcut(QKeySequence("Space"));
  play_->setToolTip("Play or pause (Space)");
  connect(play_, &QAction::triggered, this, [this] { play(!is_playing()); });
  loop_ = bar_->addAction(icon_of(Symbol::loop), "Repeat");
  loop_->setObjectName("loop");
  loop_->setCheckable(true);
  loop_->setChecked(true);

  slider_ = new QSlider(Qt::Horizontal);
  slider_->setObjectName("timeline");
  slider_->setRange(0, kSliderSteps);
  slider_->setFocusPolicy(Qt::NoFocus);
  bar_->addWidget(slider_);
  connect(slider_, &QSlider::valueChanged, this, [this](int step) {
    if (playback_->times.empty()) return;
    set_time(playback_->times.front() + duration(*playback_) * step / kSliderSteps);
  });
  readout_ = new QLabel;
  readout_->setObjectName("time");
  readout_->setMinimumWidth(128);
  readout_->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
  bar_->addWidget(readout_);
  speeds_ = new QComboBox;
  speeds_->setObjectName("speed");
  speeds_->setFocusPolicy(Qt::NoFocus);
  for (const double s : kSpeeds) speeds_->addItem(QString::number(s) + QChar(0x00D7), s);
  speeds_->setCurrentIndex(3);
  bar_->addWidget(speeds_);
  connect(speeds_, &QComboBox::currentIndexChanged, this,
          [this] { speed_ = speeds_->currentData().toDouble(); });
}

void ViewerWindow::set_frame(const Frame& frame) {
  // What the user chose to see stays when the application shows something new.
  const auto [style, section, hidden_edges] =
      std::tuple{frame_.style, frame_.section, frame_.hidden_edges};
  frame_ = frame;
  if (is_style_chosen_) {
    frame_.style = style;
    frame_.hidden_edges = hidden_edges;
  }
  if (is_section_chosen_) frame_.section = section;
  show_frame();
  list_objects();
  for (const auto& [name, flag] : {std::pair{"show_grid", &Frame::grid},
                                   {"show_axes", &Frame::world_axes},
                                   {"show_edges", &Frame::feature_edges},
                                   {"show_hidden_edges", &Frame::hidden_edges}}) {
    if (auto* action = findChild<QAction*>(name)) {
      const QSignalBlocker quiet(action);
      action->setChecked(frame.*flag);
    }
  }
  show_style_and_section();
  const QSignalBlocker quiet(perspective_);
  perspective_->setChecked(display_->camera().perspective());
}

void ViewerWindow::list_objects() {
  const QSignalBlocker blocked(objects_);
  objects_->clear();
  for (const Item& item : frame_.items) {
    auto* row = new QTreeWidgetItem(objects_, {QString::fromStdString(item.name)});
    row->setData(0, Qt::UserRole, QVariant::fromValue<qulonglong>(item.id));
    row->setIcon(0, swatch(item.appearance.colour));
    row->setSelected(item.selected);
  }
}

void ViewerWindow::update_scene(const render::Scene& scene, bool only_moved) {
  std::set<std::uint64_t> selected;
  for (const QTreeWidgetItem* row : objects_->selectedItems())
    selected.insert(row->data(0, Qt::UserRole).toULongLong());
  const auto is_same_row = [](const Item& a, const Item& b) {
    const Colour &x = a.appearance.colour, &y = b.appearance.colour;
    return a.id == b.id && a.name == b.name && x.r == y.r && x.g == y.g && x.b == y.b;
  };
  const bool has_same_rows =
      only_moved || std::equal(frame_.items.begin(), frame_.items.end(), scene.items.begin(),
                               scene.items.end(), is_same_row);
  static_cast<render::Scene&>(frame_) = scene;
  for (Item& item : frame_.items) item.selected = selected.contains(item.id);
  show_frame();
  if (!has_same_rows) list_objects();
}

void ViewerWindow::set_playback(const Playback& playback) {
  play(false);
  Playback accepted = playback;
  if (const auto verdict = check(playback); !verdict) {
    statusBar()->showMessage(QString::fromStdString(verdict.error().sentence()));
    accepted = {};
  }
  playback_ = std::make_shared<const Playback>(std::move(accepted));
  display_->set_playback(playback_);
  const bool has_motion = duration(*playback_) > 0;
  for (QAction* action : {play_, loop_, to_start_}) action->setEnabled(has_motion);
  slider_->setEnabled(has_motion);
  speeds_->setEnabled(has_motion);
  time_ = playback_->times.empty() ? 0 : playback_->times.front();
  if (has_motion && !playback_->ids.empty()) display_->set_time(time_);
  show_time();
}

void ViewerWindow::set_time(double time) {
  if (playback_->times.empty() || !std::isfinite(time)) return;
  time_ = std::clamp(time, playback_->times.front(), playback_->times.back());
  if (!playback_->ids.empty()) display_->set_time(time_);
  show_time();
  if (on_time) on_time(time_);
}

void ViewerWindow::play(bool on) {
  if (on && playback_ && duration(*playback_) > 0) {
    if (time_ >= playback_->times.back()) set_time(playback_->times.front());
    clock_.start();
    ticker_.start();
  } else {
    ticker_.stop();
  }
  play_->setIcon(icon_of(is_playing() ? Symbol::pause : Symbol::play));
  play_->setText(is_playing() ? "Pause" : "Play");
}

void ViewerWindow::set_speed(double speed) {
  if (!std::isfinite(speed) || speed <= 0) return;
  speed_ = speed;
  const QSignalBlocker quiet(speeds_);
  const int known = speeds_->findData(speed);
  if (known < 0) speeds_->addItem(QString::number(speed) + QChar(0x00D7), speed);
  speeds_->setCurrentIndex(speeds_->findData(speed));
}

void ViewerWindow::tick() {
  const double wanted = time_ + speed_ * 1e-3 * static_cast<double>(clock_.restart());
  const double first = playback_->times.front(), last = playback_->times.back();
  if (wanted < last) {
    set_time(wanted);
  } else if (loop_->isChecked()) {
    set_time(first + std::fmod(wanted - first, last - first));
  } else {
    set_time(last);
    play(false);
  }
}

void ViewerWindow::show_time() {
  const double length = duration(*playback_);
  const double first = playback_->times.empty() ? 0 : playback_->times.front();
  const QSignalBlocker quiet(slider_);
  slider_->setValue(
      length > 0 ? static_cast<int>(std::lround(kSliderSteps * (time_ - first) / length)) : 0);
  readout_->setText(length > 0 ? seconds(time_ - first) + " / " + seconds(length) : "no motion");
}

QString ViewerWindow::selected_name() const {
  const auto rows = objects_->selectedItems();
  return rows.isEmpty() ? QString() : rows.front()->text(0);
}

void ViewerWindow::show_pick(const std::optional<Pick>& hit) {
  const QSignalBlocker quiet(objects_);
  objects_->clearSelection();
  for (int i = 0; hit && i < objects_->topLevelItemCount(); ++i) {
    QTreeWidgetItem* row = objects_->topLevelItem(i);
    if (row->data(0, Qt::UserRole).toULongLong() != hit->id) continue;
    row->setSelected(true);
    objects_->scrollToItem(row);
  }
  if (hit) {
    const auto& p = hit->point;
    const auto metres = [](double x) { return QString::number(x, 'f', 3); };
    statusBar()->showMessage(QString::fromStdString(hit->name) + "   at  " + metres(p[0]) + ", " +
                             metres(p[1]) + ", " + metres(p[2]) + " m");
  } else {
    statusBar()->showMessage(kHelp);
  }
  if (on_pick) on_pick(hit);
}

void ViewerWindow::save_picture() {
  const QString path =
      QFileDialog::getSaveFileName(this, "Save picture", "picture.png", "PNG pictures (*.png)");
  if (path.isEmpty()) return;
  QApplication::setOverrideCursor(Qt::WaitCursor);
  const auto saved = [&]() -> Result<void> {
    const double r = display_->devicePixelRatioF();
    RMP_TRY_ASSIGN(const Image image, display_->still(static_cast<int>(display_->width() * r),
                                                      static_cast<int>(display_->height() * r)));
    return write_png(image, path.toStdString());
  }();
  QApplication::restoreOverrideCursor();
  if (saved) statusBar()->showMessage("Saved " + path);
  else QMessageBox::warning(this, "Save picture", QString::fromStdString(saved.error().sentence()));
}

}  // namespace robomosp::viewer
