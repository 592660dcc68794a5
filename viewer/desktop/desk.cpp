// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/desk.h"

#include <algorithm>
#include <utility>

#include <QMetaObject>

#include "viewer/desktop/values.h"

namespace robomosp::viewer {
namespace {

using ioci::Topic;

constexpr int kUnsavedAfterMs = 500;  ///< after the last edit

constexpr std::uint32_t kDeskTopics = ioci::bit(Topic::change) | ioci::bit(Topic::message) |
                                      ioci::bit(Topic::job) | ioci::bit(Topic::run) |
                                      ioci::bit(Topic::recording) | ioci::bit(Topic::command) |
                                      ioci::bit(Topic::session) | ioci::bit(Topic::unsaved) |
                                      ioci::bit(Topic::setting) | ioci::bit(Topic::memory);

}  // namespace

Result<std::unique_ptr<Desk>> Desk::open(ioci::Application& app,
                                         std::vector<std::filesystem::path> plugin_path) {
  std::unique_ptr<Desk> desk(new Desk(app));
  Desk* const d = desk.get();
  ioci::LiveView::Options options;
  options.name = "desktop";
  options.plugin_path = std::move(plugin_path);
  options.topics = kDeskTopics;
  options.waits_for_host = [](std::string_view command) { return command.starts_with("window."); };
  options.wake = [d] {
    QMetaObject::invokeMethod(
        d, [d] { d->deliver(); }, Qt::QueuedConnection);
  };
  options.on_event = [d](const ioci::Event& e) { d->take(e); };
  options.on_print = [d](const std::string& text) { d->printed(text); };
  RMP_TRY_ASSIGN(desk->base_, ioci::LiveView::open(app, std::move(options)));
  desk->unsaved_timer_.setSingleShot(true);
  desk->unsaved_timer_.setInterval(kUnsavedAfterMs);
  connect(&desk->unsaved_timer_, &QTimer::timeout, d, [d] { d->ask_unsaved(); });
  desk->ask("session.list", {}, [d](const Result<Value>& r) {
    if (!r.ok()) return;
    for (const Value& row : list_of(*r))
      if (flag_at(map_of(row), "mine"))
        d->session_ = static_cast<std::uint64_t>(whole_at(map_of(row), "number"));
  });
  return desk;
}

Desk::~Desk() = default;

void Desk::deliver() { (void)base_->deliver(); }

Desk::Done Desk::counted(Done done) {
  ++calls_;
  return [this, done = std::move(done)](const Result<Value>& r) {
    --calls_;
    if (done) done(r);
    else if (!r.ok() && r.error().code != ErrorCode::cancelled) failed(r.error());
  };
}

Desk::Done Desk::reported(const std::string& command, bool is_act, Done done) {
  const auto call = std::make_shared<const Called>(Called{command, is_act});
  called_.push_back(call);
  return counted([this, call, done = std::move(done)](const Result<Value>& r) {
    std::erase(called_, call);  // its event came before, unless the command only reads
    if (done) done(r);
    else if (call->is_act && !r.ok() && r.error().code != ErrorCode::cancelled) failed(r.error());
  });
}

Desk::Answer Desk::act(std::string command, Map args, Done done) {
  Done report = reported(command, true, std::move(done));
  return client().call(std::move(command), std::move(args), std::move(report));
}

Desk::Answer Desk::act_in(const ioci::Client::Edits& gesture, std::string command, Map args,
                          Done done) {
  Done report = reported(command, true, std::move(done));
  ioci::Client::How how;
  how.in = gesture;
  return client().call(std::move(command), std::move(args), std::move(report), std::move(how));
}

Desk::Answer Desk::start(std::string command, Map args, Done done) {
  Done report = reported(command, true, std::move(done));
  return client().start(std::move(command), std::move(args), std::move(report));
}

Desk::Answer Desk::ask(std::string command, Map args, Done done) {
  Done report = reported(command, false, std::move(done));
  return client().call(std::move(command), std::move(args), std::move(report));
}

Desk::Answer Desk::ask(std::string command, Map args, const QObject& asker, Done done) {
  return ask(
      std::move(command), std::move(args),
      [asker = QPointer<const QObject>(&asker), done = std::move(done)](const Result<Value>& r) {
        if (asker) done(r);
      });
}

Desk::Answer Desk::open_record(ioci::OpenRequest request,
                               std::function<void(const Result<ioci::Opened>&)> done) {
  const bool is_script = !request.script.empty();
  ++calls_;
  scripts_ += is_script;
  return base_->open_record(
      std::move(request), [this, is_script, done = std::move(done)](const Result<ioci::Opened>& r) {
        --calls_;
        scripts_ -= is_script;
        if (!r.ok() && r.error().code != ErrorCode::cancelled) failed(r.error());
        if (done) done(r);
      });
}

Desk::Answer Desk::evaluate(std::string input, Done done, std::shared_ptr<List> shown) {
  ++evaluating_;
  return base_->evaluate(
      std::move(input),
      [this, done = std::move(done)](const Result<Value>& r) {
        --evaluating_;
        if (done) done(r);
      },
      std::move(shown));
}

void Desk::hover(Selection what, const QObject* from) {
  if (what == hovered_) return;
  hovered_ = std::move(what);
  hover_changed(from);
}

void Desk::select(Selection selection, const QObject* from) {
  if (selection == selection_) return;
  selection_ = std::move(selection);
  selection_changed(from);
}

void Desk::ask_unsaved() {
  ask("document.unsaved", {}, [this, edits = edits_, news = unsaved_news_](const Result<Value>& r) {
    if (!r.ok()) return;
    if (news != unsaved_news_) return ask_unsaved();  // an event since then is newer
    unsaved_.clear();
    if (edits == edits_) edited_.clear();
    for (const Value& row : list_of(*r))
      if (const auto id = handle_at(map_of(row), "id")) unsaved_.insert(*id);
    unsaved_changed();
  });
}

void Desk::take_unsaved(const ioci::Event& event) {
  if (event.left_out > 0) ask_unsaved();
  if (event.topic == Topic::change && event.change) {
    bool is_other = false;
    for (const auto& each : event.change->records) {
      const Handle id{std::string(to_string(each.id.kind)), each.id.number};
      // Records that were loaded are as their files are.
      if (each.after && (each.before || each.after->file.empty()))
        is_other |= edited_.insert(id).second;
      else if (!each.after) is_other |= edited_.erase(id) > 0;
    }
    ++edits_;
    // An edit that is undone soon after is not reported by events.
    unsaved_timer_.start();
    if (is_other) unsaved_changed();
  } else if (event.topic == Topic::unsaved && event.notice) {
    ++unsaved_news_;
    for (const Value& v : list_at(event.notice->facts, "unsaved"))
      if (const Handle* h = v.as_handle()) unsaved_.insert(*h);
    for (const Value& v : list_at(event.notice->facts, "saved"))
      if (const Handle* h = v.as_handle()) {
        unsaved_.erase(*h);
        edited_.erase(*h);
      }
    unsaved_changed();
  }
}

void Desk::add_gesture_line(const ioci::CommandRun& run) {
  auto& lines = gestures_[run.gesture];
  // A drag sets the same values again and again: the last line of each place counts. What adds
  // something counts each time.
  const std::size_t value = run.line.find(", value = ");
  const bool adds = run.command.find(".add_") != std::string::npos;
  const std::string place = adds                         ? run.line
                            : value == std::string::npos ? run.command
                                                         : run.line.substr(0, value);
  const auto before = std::find_if(lines.begin(), lines.end(),
                                   [&](const auto& each) { return each.first == place; });
  if (before == lines.end() || adds) lines.emplace_back(place, run.line);
  else before->second = run.line;
}

void Desk::take(const ioci::Event& event) {
  take_unsaved(event);
  if (event.topic == Topic::command && event.command && event.command->author.session == session_ &&
      session_ != 0) {
    const ioci::CommandRun& run = *event.command;
    // Calls are reported in their order; those of Lua are none of these. What the console evaluates
    // it shows already.
    const auto call = std::find_if(called_.begin(), called_.end(), [&run](const auto& each) {
      return !run.is_scripted && each->command == run.command;
    });
    const bool is_echoed =
        run.is_scripted ? evaluating_ == 0 : call == called_.end() || (*call)->is_act;
    if (call != called_.end()) called_.erase(call);
    if (is_echoed && !run.failure && !run.only_reads) {
      if (run.gesture == 0 && run.draft == 0) acted(run.line);
      else if (run.gesture != 0) add_gesture_line(run);
    }
    if (run.command == "gesture.commit") {
      for (const auto& [number, lines] : gestures_)
        for (const auto& [command, line] : lines) acted(line);
      gestures_.clear();
    } else if (run.command == "gesture.cancel") {
      gestures_.clear();
    }
  }
  events(event);
}

}  // namespace robomosp::viewer
