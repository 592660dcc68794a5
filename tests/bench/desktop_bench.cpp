// SPDX-License-Identifier: GPL-3.0-or-later
// Measures what a user of the window waits for: its start, its rest, pictures a second, drags, the
// longest stall of its thread, large lists, plots and meshes, and memory. Prints one table.
// Usage: desktop_bench [SECTION ...], under X11, Wayland or (by itself) Xvfb.
#include <algorithm>
#include <chrono>
#include <clocale>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <unistd.h>

#include <QApplication>
#include <QElapsedTimer>
#include <QEventLoop>
#include <QLineEdit>
#include <QProcess>
#include <QScrollBar>
#include <QTemporaryDir>
#include <QTest>
#include <QTimer>
#include <QTreeView>

#include "kernel/text.h"
#include "viewer/desktop/console.h"
#include "viewer/desktop/navigator.h"
#include "viewer/forms/plot_view.h"
#include "viewer/forms/properties_panel.h"
#include "viewer/forms/schema_form.h"
#include "viewer/metered_application.h"
#include "viewer/synthetic.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_field.h"
#include "viewer/window/display.h"
#include "viewer/window_harness.h"

namespace robomosp::viewer {
namespace {

MeteredApplication& meter() { return *static_cast<MeteredApplication*>(QApplication::instance()); }

double load() {
  std::ifstream file("/proc/loadavg");
  double value = 0;
  file >> value;
  return value;
}

/// Prints one row of the table. `limit` < 0: no aim; `is_least`: the aim is a least value.
void row(const std::string& what, double value, const char* unit, double limit,
         const std::string& note = {}, bool is_least = false) {
  char number[64];
  std::snprintf(number, sizeof number, "%.3g", value);
  std::string aim, met;
  if (limit >= 0) {
    char text[64];
    std::snprintf(text, sizeof text, "%s %.3g", is_least ? "at least" : "at most", limit);
    aim = text;
    met = (is_least ? value >= limit : value <= limit) ? "yes" : "**no**";
  }
  std::printf("| %s | %s | %s | %s | %s | %s |\n", what.c_str(), number, unit, aim.c_str(),
              met.c_str(), note.c_str());
  std::fflush(stdout);
}

std::string rounded(double v) { return text::print_rounded(v); }

double median(std::vector<double> v) {
  if (v.empty()) return std::nan("");
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

// --- start and memory: the program itself ----------------------------------------------------

const std::string kDesktop = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp-desktop";

QProcessEnvironment environment_in(const QTemporaryDir& home) {
  QProcessEnvironment e = QProcessEnvironment::systemEnvironment();
  e.insert("HOME", home.path());
  for (const char* name : {"XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_DATA_HOME"})
    e.remove(name);
  e.insert("ROBOMOSP_NO_THUMBNAILS", "1");
  return e;
}

/// The times of a step in the output of --start-times: elapsed and processor time [s].
std::pair<double, double> times_of(const std::string& table, const std::string& step) {
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string elapsed, processor, name;
    words >> elapsed >> processor;
    std::getline(words >> std::ws, name);
    if (name == step)
      return {text::read_real(elapsed).value_or(-1), text::read_real(processor).value_or(-1)};
  }
  return {std::nan(""), std::nan("")};
}

void measure_start() {
  constexpr int kRuns = 5;
  const QTemporaryDir home;
  const auto started = [&](const QStringList& args) {
    QProcess p;
    p.setProcessEnvironment(environment_in(home));
    p.start(QString::fromStdString(kDesktop), args + QStringList{"--start-times"});
    p.waitForFinished(120000);
    return p.readAllStandardOutput().toStdString();
  };
  const auto measure = [&](const std::string& what, const QStringList& args, double limit) {
    std::vector<double> elapsed, processor;
    std::string last;
    for (int i = 0; i < kRuns; ++i) {
      last = started(args);
      const auto [e, p] = times_of(last, "usable");
      elapsed.push_back(e);
      processor.push_back(p);
    }
    row(what, median(elapsed), "s", limit,
        "processor time " + rounded(median(processor)) + " s; least elapsed " +
            rounded(*std::min_element(elapsed.begin(), elapsed.end())) + " s");
    return last;
  };
  const std::string first = started({});
  row("start, nothing kept by earlier runs", times_of(first, "usable").first, "s", -1,
      "processor time " + rounded(times_of(first, "usable").second) + " s");
  const std::string steps = measure("start to a usable start page", {}, 1.5);
  measure("start to the PA-10 on its circle", {"pa10_circle"}, -1);
  std::fprintf(stderr, "%s", steps.c_str());
}

/// A line of /proc/<pid>/<file> such as "Pss:   123 kB" [MiB].
double memory_of(qint64 pid, const char* file, const std::string& name) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/" + file);
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(name + ":"))
      return text::read_real(
                 text::trim(line.substr(name.size() + 1, line.size() - name.size() - 3)))
                 .value_or(0) /
             1024;
  return std::nan("");
}

void measure_memory() {
  const auto run = [](const std::string& what, const QStringList& args, double limit) {
    const QTemporaryDir home;
    QProcess p;
    p.setProcessEnvironment(environment_in(home));
    p.start(QString::fromStdString(kDesktop), args);
    p.waitForStarted();
    const qint64 pid = p.processId();
    const auto private_of = [pid] {
      return memory_of(pid, "smaps_rollup", "Private_Dirty") +
             memory_of(pid, "smaps_rollup", "Private_Clean");
    };
    // At rest: no more processor time is used, and what drew the still picture has been freed.
    const auto ticks = [pid] {
      std::ifstream in("/proc/" + std::to_string(pid) + "/schedstat");
      double t = 0;
      in >> t;
      return t;
    };
    double before = -1;
    QElapsedTimer clock;
    clock.start();
    while (clock.elapsed() < 60000) {
      QTest::qWait(1500);
      const double now = ticks();
      if (now - before < 3e6 && clock.elapsed() > 12000) break;
      before = now;
    }
    const double pss = memory_of(pid, "smaps_rollup", "Pss");
    row(what, pss, "MiB", limit,
        "proportional share at rest; private " + rounded(private_of()) + ", resident " +
            rounded(memory_of(pid, "status", "VmRSS")) + ", most resident " +
            rounded(memory_of(pid, "status", "VmHWM")));
    p.terminate();
    if (!p.waitForFinished(5000)) p.kill();
    p.waitForFinished(5000);
  };
  run("memory, start page", {}, -1);
  run("memory, PA-10 on its circle", {"pa10_circle", "--still"}, 250);
}

// --- rest --------------------------------------------------------------------------------------

/// Opens the PA-10 on its circle.
void open_pa10(WindowHarness& h) {
  ioci::OpenRequest request;
  request.what = "pa10_circle";
  h.window().open(std::move(request), false);
  h.until([&] { return h.window().current_view() != nullptr; });
  h.settle();
}

void measure_rest(ioci::Application& app) {
  WindowHarness h(app, {1440, 900}, true);
  open_pa10(h);
  std::size_t busiest_events = 0;
  double busiest = 0;
  std::string busiest_room, most_events;
  const auto rest = [&](const std::string& room, int after_ms) {
    h.settle();
    QTest::qWait(after_ms);
    const int drawn =
        h.window().current_view() ? h.window().current_view()->display().pictures_drawn() : 0;
    meter().reset();
    const double processor = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
    constexpr int kRestMs = 5000;
    // An empty loop, as qWait() itself wakes every 10 ms.
    QEventLoop loop;
    QTimer::singleShot(kRestMs, &loop, &QEventLoop::quit);
    loop.exec();
    const double share = (seconds_of(CLOCK_PROCESS_CPUTIME_ID) - processor) / (1e-3 * kRestMs);
    const int pictures =
        (h.window().current_view() ? h.window().current_view()->display().pictures_drawn() : 0) -
        drawn;
    std::string types;
    for (const auto& [type, count] : meter().by_type())
      types += " " + std::to_string(type) + " x " + std::to_string(count);
    std::fprintf(stderr, "rest, %s: %.2f %% of a core, %zu events (%s ), %d pictures\n",
                 room.c_str(), 100 * share, meter().events(), types.c_str(), pictures);
    if (share >= busiest) busiest = share, busiest_room = room;
    if (meter().events() >= busiest_events)
      busiest_events = meter().events(), most_events = room + ":" + types;
  };
  for (const Workspace w :
       {Workspace::model, Workspace::robot, Workspace::motion, Workspace::program}) {
    h.window().set_workspace(w);
    // What drew the still picture is freed after a while.
    rest(std::string("workspace ") + kWorkspaceNames[static_cast<std::size_t>(w)], 6000);
  }
  h.window().set_workspace(Workspace::motion);
  for (const QString& panel : h.window().panels()) {
    h.window().show_panel(panel);
    rest("panel " + panel.toStdString(), 1200);  // what is saved after a while
  }
  row("processor at rest, the busiest panel or workspace", 100 * busiest, "% of a core", 0.5,
      busiest_room);
  row("events in 5 s at rest, the most", static_cast<double>(busiest_events), "", 5, most_events);
}

// --- pictures ------------------------------------------------------------------------------------

Frame cell_with(int triangles) {
  Frame frame = synthetic::robot_cell();
  std::size_t count = 0;
  for (const Item& item : frame.items)
    if (item.mesh) count += item.mesh->triangles.size() / 3;
  int id = 9000;
  constexpr int kEach = 8000;
  for (int left = triangles - static_cast<int>(count), i = 0; left > 400; left -= kEach, ++i) {
    Item item;
    item.id = static_cast<std::uint64_t>(id++);
    item.mesh = synthetic::sphere(0.08, std::min(left, kEach));
    item.pose.p = {0.3 * (i % 8) - 1, 0.6 + 0.2 * (i / 8), 0.1};
    frame.items.push_back(item);
  }
  return frame;
}

void measure_pictures() {
  for (const auto& [triangles, limit] : {std::pair{25000, 40.0}, std::pair{300000, -1.0}}) {
    auto made = Display::create(Quality::fast);
    if (!made.ok()) {
      std::fprintf(stderr, "no display: %s\n", made.error().sentence().c_str());
      return;
    }
    Display& display = **made;
    display.resize(1280, 800);
    display.set_frame(cell_with(triangles));
    display.show();
    WindowHarness::until([&] { return display.pictures_drawn() > 0; });
    QTest::qWait(500);
    const QPoint middle(640, 400);
    QTest::mousePress(&display, Qt::LeftButton, {}, middle);
    std::vector<double> times;
    const double begin = seconds_of(CLOCK_MONOTONIC),
                 processor = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
    int count = 0;
    while (seconds_of(CLOCK_MONOTONIC) - begin < 4) {
      const int drawn = display.pictures_drawn();
      const double one = seconds_of(CLOCK_MONOTONIC);
      // Never twice at one place, which would change nothing.
      move_mouse(display, middle + QPointF(300 * std::sin(0.05 * (count + 1)), count % 2));
      while (display.pictures_drawn() == drawn && seconds_of(CLOCK_MONOTONIC) - one < 10)
        QApplication::processEvents();
      times.push_back(1e3 * (seconds_of(CLOCK_MONOTONIC) - one));
      ++count;
    }
    const double took = seconds_of(CLOCK_MONOTONIC) - begin;
    QTest::mouseRelease(&display, Qt::LeftButton, {}, middle);
    row("pictures a second, 1280x800, " + std::to_string(triangles) + " triangles, orbiting",
        count / took, "1/s", limit,
        display.renderer_name().toStdString() + "; middle " + rounded(median(times)) +
            " ms; processor time " +
            rounded(1e3 * (seconds_of(CLOCK_PROCESS_CPUTIME_ID) - processor) / count) +
            " ms each, all threads",
        true);
  }
}

// --- drags ---------------------------------------------------------------------------------------

/// As WindowHarness::until(), with events handled when they come, as in the program: qWaitFor()
/// sleeps for 10 ms after each look.
bool until_promptly(const std::function<bool()>& is_so, int patience_ms) {
  QElapsedTimer clock;
  clock.start();
  for (;;) {
    QCoreApplication::processEvents();
    if (is_so()) return true;
    if (clock.elapsed() > patience_ms) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

NumberField* first_number(QWidget* form) {
  for (QWidget* w : form->findChildren<QWidget*>())
    if (auto* field = dynamic_cast<NumberField*>(w); field && field->isVisible() &&
                                                     field->isEnabled() && field->value() &&
                                                     !field->value()->as_string())
      return field;
  return nullptr;
}

void measure_drags(ioci::Application& app) {
  WindowHarness h(app, {1440, 900}, true);
  open_pa10(h);
  const Handle block = h.made("solid.get", {{"name", "block"}});
  h.desk().select({{block, "nodes.blank"}});
  h.settle();
  QTest::qWait(300);
  NumberField* field = nullptr;
  h.until([&] { return (field = first_number(h.window().properties().form())) != nullptr; }, 5000);
  if (!field) {
    std::fprintf(stderr, "no number to drag in the properties of the solid\n");
    return;
  }
  ViewTab& view = *h.window().current_view();
  std::vector<double> scene_ms, picture_ms, mass_ms, torque_ms;
  const QPoint at(field->width() / 2, field->height() / 2);
  QTest::mousePress(field, Qt::LeftButton, {}, at);
  const Handle robot = h.made("robot.get", {{"name", "pa10"}});
  for (int i = 1; i <= 60; ++i) {
    const auto before = view.live().picture();
    const int drawn = view.display().pictures_drawn();
    const double begin = seconds_of(CLOCK_MONOTONIC);
    double mass = 0, torque = 0;
    move_mouse(*field, at + QPointF(8 + i % 17, 0));
    h.desk().ask("solid.mass", {{"id", block}},
                 [&](const Result<Value>&) { mass = seconds_of(CLOCK_MONOTONIC) - begin; });
    h.desk().ask("robot.gravity_torques",
                 {{"id", robot}, {"q", List{0.0, 0.2, 0.0, 1.3, 0.0, 1.6, 0.0}}},
                 [&](const Result<Value>&) { torque = seconds_of(CLOCK_MONOTONIC) - begin; });
    double scene = 0;
    const bool is_shown = until_promptly(
        [&] {
          const bool is_made = view.live().picture() != before;
          if (is_made && scene <= 0) scene = seconds_of(CLOCK_MONOTONIC) - begin;
          return is_made && view.display().pictures_drawn() > drawn;
        },
        2000);
    const double shown_after = seconds_of(CLOCK_MONOTONIC) - begin;
    until_promptly([&] { return mass > 0 && torque > 0; }, 5000);
    if (is_shown && i > 3) picture_ms.push_back(1e3 * shown_after), scene_ms.push_back(1e3 * scene);
    if (i > 3) mass_ms.push_back(1e3 * mass), torque_ms.push_back(1e3 * torque);
  }
  QTest::mouseRelease(field, Qt::LeftButton, {}, at + QPoint(10, 0));
  h.settle();
  const auto worst = [](const std::vector<double>& v) {
    return v.empty() ? std::string("none")
                     : "worst " + rounded(*std::max_element(v.begin(), v.end())) + " ms of " +
                           std::to_string(v.size());
  };
  row("dragged number to its scene", median(scene_ms), "ms", -1, worst(scene_ms));
  row("dragged number to its picture (PA-10 world)", median(picture_ms), "ms", 50,
      field->objectName().toStdString() + ", " + worst(picture_ms));
  row("dragged number to the mass", median(mass_ms), "ms", 100, worst(mass_ms));
  row("dragged number to the torques", median(torque_ms), "ms", 100, worst(torque_ms));
}

// --- stalls --------------------------------------------------------------------------------------

void stall_rows(const std::string& what, double limit) {
  const auto& most = meter().longest();
  const auto& busiest = meter().busiest();
  row(what + ", by the clock", 1e3 * most.elapsed, "ms", limit,
      most.receiver + ", event " + std::to_string(most.type) + ", processor " +
          rounded(1e3 * most.processor) + " ms");
  row(what + ", by the thread's processor time", 1e3 * busiest.processor, "ms", limit,
      busiest.receiver + ", event " + std::to_string(busiest.type));
}

void measure_stalls(ioci::Application& app) {
  WindowHarness h(app, {1440, 900}, true);
  open_pa10(h);
  h.window().console().run(
      "local t = os.clock() while os.clock() - t < 30 do end return 'the command has ended'");
  QTest::qWait(200);
  meter().reset();
  Console& console = h.window().console();
  const int panels = static_cast<int>(h.window().panels().size());
  for (int i = 0; !console.text().contains("'the command has ended'\n\"") && i < 60; ++i) {
    h.window().show_panel(h.window().panels()[i % panels]);
    QTest::keyClicks(&console.input(), "1 + 1");
    QTest::qWait(500);
    console.input().clear();
    if (console.text().trimmed().endsWith("the command has ended") ||
        console.text().trimmed().endsWith("the command has ended\""))
      break;
  }
  stall_rows("longest stall in a command of 30 s, panels changed", 16);
}

// --- sizes ---------------------------------------------------------------------------------------

void measure_navigator(ioci::Application& app) {
  WindowHarness h(app, {1200, 800}, true);
  const Handle box = h.made(
      "solid.create",
      {{"name", "block"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  const Handle world = h.made("world.create", {{"name", "large"}});
  List objects;
  for (int i = 0; i < 10000; ++i)
    objects.emplace_back(Map{{"what", box}, {"name", "part_" + std::to_string(i)}});
  h.settle();
  (void)h.call("world.add_objects", {{"id", world}, {"objects", std::move(objects)}});
  h.settle();
  meter().reset();
  QTreeView& tree = h.window().navigator().tree();
  const double begin = seconds_of(CLOCK_MONOTONIC);
  const auto row_of = [&](const QModelIndex& parent, const QString& text) {
    QModelIndex found;
    h.until(
        [&] {
          const QAbstractItemModel* m = tree.model();
          if (m->canFetchMore(parent)) const_cast<QAbstractItemModel*>(m)->fetchMore(parent);
          for (int i = 0; i < m->rowCount(parent); ++i)
            if (m->index(i, 0, parent).data().toString() == text) found = m->index(i, 0, parent);
          return found.isValid();
        },
        10000);
    return found;
  };
  const QModelIndex top = row_of({}, "large");
  tree.expand(top);
  const QModelIndex list = row_of(top, "Objects");
  tree.expand(list);
  h.until([&] { return tree.model()->rowCount(list) >= 10000; }, 30000);
  QApplication::processEvents();
  row("10,000 rows of the navigator, opened", 1e3 * (seconds_of(CLOCK_MONOTONIC) - begin), "ms", -1,
      std::to_string(tree.model()->rowCount(list)) + " rows");
  stall_rows("longest event meanwhile", -1);
  meter().reset();
  const double scroll = seconds_of(CLOCK_MONOTONIC);
  constexpr int kSteps = 50;
  for (int i = 0; i <= kSteps; ++i) {
    tree.verticalScrollBar()->setValue(tree.verticalScrollBar()->maximum() * i / kSteps);
    QApplication::processEvents();
  }
  row("scrolled through them, one step", 1e3 * (seconds_of(CLOCK_MONOTONIC) - scroll) / kSteps,
      "ms", 16);
  meter().reset();
  auto* search = h.window().navigator().findChild<QLineEdit*>();
  if (search) {
    search->setFocus();
    QTest::keyClicks(search, "part_9999");
    QTest::qWait(600);
  }
  stall_rows("longest event of a search in them", -1);
  app.document.clear();
}

void measure_plot() {
  PlotView plot;
  plot.resize(900, 300);
  auto data = std::make_shared<PlotData>();
  data->columns.push_back({"tau", "N m", {}});
  for (int i = 0; i < 1'000'000; ++i) {
    data->x.push_back(i * 1e-3);
    data->columns[0].values.push_back(std::sin(i * 1e-4) + 0.1 * std::sin(i * 0.37));
  }
  plot.show_data(data);
  std::vector<double> times;
  for (int i = 0; i < 10; ++i) {
    const double begin = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    (void)plot.grab();
    times.push_back(1e3 * (seconds_of(CLOCK_THREAD_CPUTIME_ID) - begin));
  }
  row("a plot of a million points, drawn", median(times), "ms", 50, "processor time");
}

void measure_closing(ioci::Application& app) {
  std::vector<double> times;
  for (int i = 0; i < 3; ++i) {
    auto h = std::make_unique<WindowHarness>(app);
    ioci::OpenRequest request;
    request.what = "pa10_circle";
    h->window().open(std::move(request), false);
    h->until([&] { return h->window().current_view() != nullptr; });
    h->settle();
    const double begin = seconds_of(CLOCK_MONOTONIC);
    h.reset();
    times.push_back(seconds_of(CLOCK_MONOTONIC) - begin);
    app.document.clear();
  }
  row("closing the window with the PA-10 world", median(times), "s", 0.5);
}

}  // namespace
}  // namespace robomosp::viewer

int main(int argc, char** argv) {
  using namespace robomosp::viewer;
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY") &&
      !std::getenv("QT_QPA_PLATFORM")) {
    std::vector<const char*> args{"xvfb-run", "-a", "-s", "-screen 0 1920x1200x24 +extension GLX"};
    for (int i = 0; i < argc; ++i) args.push_back(argv[i]);
    args.push_back(nullptr);
    execvp("xvfb-run", const_cast<char**>(args.data()));
    std::fprintf(stderr, "desktop_bench: no display, and no xvfb-run to make one\n");
    return 1;
  }
  const std::vector<std::string> wanted(argv + 1, argv + argc);
  const auto is_wanted = [&](const char* section) {
    return wanted.empty() || std::find(wanted.begin(), wanted.end(), section) != wanted.end();
  };
  qputenv("ROBOMOSP_NO_THUMBNAILS", "1");
  MeteredApplication application(argc, argv);
  std::setlocale(LC_NUMERIC, "C");
  set_theme(application, make_theme(true));
  std::printf("Load of the machine before: %.2f.\n\n", load());
  std::printf("| what | measured | unit | aim | met | |\n|---|---|---|---|---|---|\n");
  if (is_wanted("start")) measure_start();
  if (is_wanted("memory")) measure_memory();
  if (is_wanted("pictures")) measure_pictures();
  if (is_wanted("plot")) measure_plot();
  {
    const auto app = start_program();
    if (is_wanted("rest")) measure_rest(*app);
    app->document.clear();
    if (is_wanted("drags")) measure_drags(*app);
    app->document.clear();
    if (is_wanted("stalls")) measure_stalls(*app);
    app->document.clear();
    if (is_wanted("navigator")) measure_navigator(*app);
    if (is_wanted("closing")) measure_closing(*app);
  }
  std::printf("\nLoad of the machine after: %.2f.\n", load());
  return 0;
}
