// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/start_times.h"

#include <cstdio>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <locale>
#include <optional>
#include <sstream>
#include <utility>

#include <unistd.h>

#include <QEvent>

#include "kernel/text.h"
#include "viewer/desktop/main_window.h"

namespace robomosp::viewer {
namespace {

double seconds_of_clock(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// When the system began this process, to 10 ms, as seconds since the system itself started.
std::optional<double> begin_of_process() {
  std::ifstream file("/proc/self/stat");
  const std::string line{std::istreambuf_iterator<char>(file), {}};
  // The name of the program, in parentheses, may have spaces.
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) return std::nullopt;
  std::istringstream words(line.substr(name_end + 1));
  constexpr int kStartTime = 20;  // the words after the name up to it; see proc(5)
  std::string word;
  for (int i = 0; i < kStartTime; ++i) words >> word;
  const auto ticks = text::read_real(word);
  if (!ticks) return std::nullopt;
  return *ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

constexpr int kLookEachMs = 5;
/// After as many looks the program ends, whatever is missing: a minute.
constexpr int kMostLooks = 12000;

}  // namespace

StartTimes::StartTimes() : begin_(begin_of_process().value_or(seconds_of_clock(CLOCK_BOOTTIME))) {}

void StartTimes::reached(std::string step) {
  steps_.push_back({std::move(step), seconds_of_clock(CLOCK_BOOTTIME) - begin_,
                    seconds_of_clock(CLOCK_PROCESS_CPUTIME_ID)});
}

std::string StartTimes::table() const {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "elapsed [s]  processor [s]  step\n" << std::fixed << std::setprecision(3);
  for (const Step& s : steps_)
    out << std::setw(11) << s.elapsed << std::setw(15) << s.processor << "  " << s.name << '\n';
  return out.str();
}

StartWatch::StartWatch(MainWindow& window, StartTimes& times) : window_(window), times_(times) {
  window.installEventFilter(this);
  window.desk().failed.add(
      this, [](const Error& e) { std::fprintf(stderr, "warning: %s\n", e.sentence().c_str()); });
  connect(&timer_, &QTimer::timeout, this, [this] { look(); });
}

bool StartWatch::eventFilter(QObject* object, QEvent* event) {
  if (object == &window_ && event->type() == QEvent::Paint && !std::exchange(is_painted_, true))
    // After the whole window has been painted.
    QTimer::singleShot(0, this, [this] {
      times_.reached("window painted");
      timer_.start(kLookEachMs);
    });
  return QObject::eventFilter(object, event);
}

void StartWatch::look() {
  const ViewTab* view = window_.current_view();
  const auto picture = view ? view->live().picture() : nullptr;
  const bool is_drawn = !view || (picture && picture->frame && picture->frame->is_exact &&
                                  view->display().pictures_drawn() > 0);
  const bool is_usable = !window_.desk().has_calls() && is_drawn;
  if (!is_usable && ++looks_ < kMostLooks) return;
  timer_.stop();
  times_.reached(is_usable ? "usable" : "not usable after a minute");
  std::fputs(times_.table().c_str(), stdout);
  std::fflush(stdout);
  window_.close_now();
}

}  // namespace robomosp::viewer
