// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/desk.h"

#include <utility>

#include <QMetaObject>

#include "viewer/desktop/values.h"

namespace robomosp::viewer {
namespace {

using ioci::Topic;

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
  options.wake = [d] {
    QMetaObject::invokeMethod(
        d, [d] { d->deliver(); }, Qt::QueuedConnection);
  };
  options.on_event = [d](const ioci::Event& e) { d->take(e); };
  options.on_print = [d](const std::string& text) { d->printed(text); };
  RMP_TRY_ASSIGN(desk->base_, ioci::LiveView::open(app, std::move(options)));
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

Desk::Done Desk::noted_act(const std::string& command, Done done) {
  ++acts_[command];
  return counted([this, command, done = std::move(done)](const Result<Value>& r) {
    // Its event came before, unless the command only reads.
    if (const auto at = acts_.find(command); at != acts_.end()) acts_.erase(at);
    if (done) done(r);
    else if (!r.ok() && r.error().code != ErrorCode::cancelled) failed(r.error());
  });
}

Desk::Answer Desk::act(std::string command, Map args, Done done) {
  Done report = noted_act(command, std::move(done));
  return client().call(std::move(command), std::move(args), std::move(report));
}

Desk::Answer Desk::start(std::string command, Map args, Done done) {
  Done report = noted_act(command, std::move(done));
  return client().start(std::move(command), std::move(args), std::move(report));
}

Desk::Answer Desk::ask(std::string command, Map args, Done done) {
  ++asks_[command];
  done = [this, command, done = std::move(done)](const Result<Value>& r) {
    if (const auto at = asks_.find(command); at != asks_.end() && --at->second == 0)
      asks_.erase(at);
    if (done) done(r);
  };
  return client().call(std::move(command), std::move(args), counted(std::move(done)));
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

Desk::Answer Desk::evaluate(std::string input, Done done) {
  ++evaluating_;
  return base_->evaluate(std::move(input), [this, done = std::move(done)](const Result<Value>& r) {
    --evaluating_;
    if (done) done(r);
  });
}

void Desk::select(Selection selection, const QObject* from) {
  if (selection == selection_) return;
  selection_ = std::move(selection);
  selection_changed(from);
}

void Desk::take(const ioci::Event& event) {
  if (event.topic == Topic::command && event.command && event.command->author.session == session_ &&
      session_ != 0) {
    const ioci::CommandRun& run = *event.command;
    const auto known = acts_.find(run.command);
    const bool is_act = known != acts_.end();
    if (is_act && --known->second == 0) acts_.erase(known);
    const bool is_asked = !is_act && asks_.contains(run.command);
    if ((is_act || evaluating_ == 0) && !is_asked && !run.failure && !run.only_reads) {
      if (run.gesture == 0 && run.draft == 0) acted(run.line);
      else if (run.gesture != 0) gestures_[run.gesture] = run.line;
    }
    if (run.command == "gesture.commit") {
      for (const auto& [number, line] : gestures_) acted(line);
      gestures_.clear();
    } else if (run.command == "gesture.cancel") {
      gestures_.clear();
    }
  }
  events(event);
}

}  // namespace robomosp::viewer
