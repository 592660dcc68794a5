// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/watchers.h"

#include <algorithm>
#include <utility>

#include "ioci/core/application.h"
#include "ioci/core/commands.h"
#include "kernel/permit.h"

namespace robomosp::ioci {
namespace {

std::string shown(const WatchStatus& w) {
  if (w.what == "recording") return "recording#" + std::to_string(w.recording);
  return text::quote(w.file);
}

/// Whether a job has ended, be it before its turn came.
bool is_over(const Jobs& jobs, std::uint64_t id) {
  const auto status = jobs.status(id);
  return !status.ok() || (status->state != JobState::waiting && status->state != JobState::running);
}

}  // namespace

/// Ends where the job is cancelled, and where there was another edit.
class RecordingWatchers::Pass final : public Progress {
 public:
  Pass(Progress& job, const std::atomic<std::uint64_t>& generation)
      : job_(job), generation_(generation), began_(generation) {}
  void report(double fraction, std::string_view what) override { job_.report(fraction, what); }
  [[nodiscard]] bool cancelled() const override { return job_.cancelled() || is_overtaken(); }
  [[nodiscard]] bool is_overtaken() const { return generation_ != began_; }

 private:
  Progress& job_;
  const std::atomic<std::uint64_t>& generation_;
  const std::uint64_t began_;
};

ParamSpec watch_field() {
  return defaulted("watch", "bool", "", false,
                   "Make it again after each edit of the records it was made from; "
                   "recording.unwatch ends this.");
}
Schema with_watch(Schema params) {
  params.push_back(watch_field());
  return params;
}
ParamSpec watch_file_field() {
  return defaulted(
      "watch", "bool", "", false,
      "Draw the file again after each edit of its records; recording.unwatch ends this.");
}

Result<void> watch_drawing(CommandContext& ctx, const std::string& command, const Map& checked) {
  if (!flag(checked, "watch")) return {};
  Map given;
  for (const auto& [name, value] : checked)
    if (const Value* as_given = ctx.given(name)) given.set(name, *as_given);
  return ctx.app.watchers->add_drawing(ctx.snapshot(), command, given, checked);
}

void RecordingWatchers::start() {
  app_.document.on_commit([this](const document::Commit& commit) {
    if (count_.load(std::memory_order_relaxed) == 0) return;
    using enum document::CommitKind;
    if (commit.kind == preview || commit.kind == save) return;
    if (commit.kind != clear) return look();
    const std::size_t ended = remove([](const WatchStatus&) { return true; });
    app_.messages.post(Severity::info, "watch",
                       "The document was cleared: " + std::to_string(ended) +
                           (ended == 1 ? " recording or file is" : " recordings or files are") +
                           " watched no longer.",
                       "watch");
  });
}

void RecordingWatchers::stop() {
  std::uint64_t job = 0;
  {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    job = job_;
  }
  if (job != 0) app_.jobs.cancel(job);
}

Result<void> RecordingWatchers::add_recording(std::uint64_t number) {
  const OriginPtr origin = app_.origins->find(number);
  if (!origin || !origin->fixed.empty())
    return error(ErrorCode::unsupported,
                 "recording#" + std::to_string(number) + " cannot follow edits: " +
                     (origin ? origin->fixed : std::string("no command of this run made it")),
                 "Watch a recording made by a simulation.", "watch");
  const std::lock_guard lock(mutex_);
  for (const Watch& w : watches_)
    if (w.status.what == "recording" && w.status.recording == number) return {};
  Watch w;
  w.status = {next_++, "recording", number, "", "current", ""};
  w.recordings.insert(number);
  watches_.push_back(std::move(w));
  count_ = watches_.size();
  return {};
}

Result<void> RecordingWatchers::add_drawing(const document::Snapshot& snapshot,
                                            const std::string& command, const Map& given,
                                            const Map& checked) {
  const bool is_folder = !checked.find("file");
  const Value* file = checked.find(is_folder ? "folder" : "file");
  if (!file || !file->as_string())
    return error(ErrorCode::invalid_argument, "there is no file that could be kept up to date",
                 "Give file = ..., or the folder of a command that writes several.", "watch");
  Watch w;
  w.draws.command = command;
  for (const auto& [name, value] : given) {
    if (name == "watch") continue;
    const Value* read = checked.find(name);
    w.draws.args.set(name, read && read->as_handle() ? *read : value);
  }
  if (is_folder) w.draws.args.set("overwrite", true);
  w.inputs = inputs_of(app_, snapshot, checked);
  if (const Permit* permit = current_permit()) w.files = permit->files;
  for (const auto& [number, r] : w.inputs.recordings) w.recordings.insert(number);
  w.status = {
      0,         command, w.recordings.empty() ? 0 : *w.recordings.begin(), *file->as_string(),
      "current", ""};
  const std::lock_guard lock(mutex_);
  std::erase_if(watches_, [&](const Watch& old) { return old.status.file == w.status.file; });
  w.status.number = next_++;
  watches_.push_back(std::move(w));
  count_ = watches_.size();
  return {};
}

std::vector<WatchStatus> RecordingWatchers::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<WatchStatus> out;
  for (const Watch& w : watches_) out.push_back(w.status);
  return out;
}

bool RecordingWatchers::draws(const std::string& file) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(watches_.begin(), watches_.end(),
                     [&](const Watch& w) { return w.status.file == file; });
}

std::size_t RecordingWatchers::remove(const std::function<bool(const WatchStatus&)>& is_it) {
  const std::lock_guard lock(mutex_);
  const std::size_t removed =
      std::erase_if(watches_, [&](const Watch& w) { return is_it(w.status); });
  count_ = watches_.size();
  if (removed > 0) ++generation_;  // what is being computed for them ends
  return removed;
}

bool RecordingWatchers::settle(const std::function<bool()>& gives_up) {
  for (;;) {
    std::uint64_t job = 0;
    {
      const std::lock_guard lock(mutex_);
      job = job_;
    }
    if (job == 0) return true;
    (void)app_.jobs.wait(job, gives_up);
    if (gives_up && gives_up()) return false;
    const std::lock_guard lock(mutex_);
    if (job_ == job && is_over(app_.jobs, job)) job_ = 0;
  }
}

void RecordingWatchers::look(const Session* by) {
  if (by == &session_ || count_.load(std::memory_order_relaxed) == 0) return;
  const std::lock_guard lock(mutex_);
  if (is_stopped_) return;
  ++generation_;
  for (Watch& w : watches_) w.status.state = "waiting";
  if (job_ != 0 && !is_over(app_.jobs, job_)) return;  // it sees that there was another edit
  const PermitScope own(nullptr);
  job_ = app_.jobs.submit("watched recordings", [this](Progress& p) { return work(p); });
}

Result<Value> RecordingWatchers::work(Progress& progress) {
  for (;;) {
    Pass pass(progress, generation_);
    update(pass);
    const std::lock_guard lock(mutex_);
    if (pass.is_overtaken() && !progress.cancelled() && !is_stopped_) continue;
    for (Watch& w : watches_)
      if (w.status.state == "working") w.status.state = "waiting";  // it was cancelled
    job_ = 0;
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the update of watched recordings was cancelled");
    return Value();
  }
}

void RecordingWatchers::update(Progress& progress) {
  std::set<std::uint64_t> recordings;
  std::vector<std::uint64_t> drawings;
  {
    const std::lock_guard lock(mutex_);
    for (const Watch& w : watches_) {
      recordings.insert(w.recordings.begin(), w.recordings.end());
      if (w.status.what != "recording") drawings.push_back(w.status.number);
    }
  }
  for (const std::uint64_t number : recordings) {
    if (progress.cancelled()) return;
    update_recording(number, progress);
  }
  for (const std::uint64_t number : drawings) {
    if (progress.cancelled()) return;
    update_drawing(number, progress);
  }
}

void RecordingWatchers::told(const std::function<bool(const WatchStatus&)>& of,
                             const std::string& state, const std::string& fault) {
  std::vector<std::string> said;
  {
    const std::lock_guard lock(mutex_);
    for (Watch& w : watches_) {
      if (!of(w.status)) continue;
      w.status.state = state;
      if (state == "working") continue;
      if (!fault.empty() && w.status.fault != fault)
        said.push_back(shown(w.status) + " could not follow the last edit: " + fault);
      w.status.fault = fault;
    }
  }
  for (const std::string& sentence : said)
    app_.messages.post(Severity::warning, "watch", sentence, "watch");
}

void RecordingWatchers::update_recording(std::uint64_t number, Progress& progress) {
  const auto is_it = [number](const WatchStatus& w) {
    return w.what == "recording" && w.recording == number;
  };
  if (!app_.recordings.find(number)) {
    const std::size_t ended = remove([&](const WatchStatus& w) { return w.recording == number; });
    if (ended > 0)
      app_.messages.post(
          Severity::info, "watch",
          "recording#" + std::to_string(number) + " was removed, and is watched no longer.",
          "watch");
    return;
  }
  const OriginPtr origin = app_.origins->find(number);
  if (!origin || !origin->fixed.empty()) return;  // drawn, but not made here
  if (changes_since(app_, *app_.document.now(), origin->inputs).empty())
    return told(is_it, "current", "");
  told(is_it, "working", "");
  const auto made = app_.dispatch_beside(session_, "recording.refresh",
                                         Map{{"id", Handle{"recording", number}}}, progress);
  if (made.ok()) return told(is_it, "current", "");
  if (progress.cancelled()) return;
  // Where only drawings show it, they say so.
  const auto shows = [&](const WatchStatus& w) { return w.recording == number; };
  told(shows, "failed", made.error().sentence());
}

void RecordingWatchers::update_drawing(std::uint64_t number, Progress& progress) {
  const auto is_it = [number](const WatchStatus& w) { return w.number == number; };
  Watch watch;
  {
    const std::lock_guard lock(mutex_);
    const auto it = std::find_if(watches_.begin(), watches_.end(),
                                 [&](const Watch& w) { return w.status.number == number; });
    if (it == watches_.end()) return;
    watch = *it;
  }
  const document::SnapshotPtr now = app_.document.now();
  if (changes_since(app_, *now, watch.inputs).empty()) {
    if (watch.status.state == "failed") return;  // its recording could not be made
    return told(is_it, "current", "");
  }
  told(is_it, "working", "");
  Inputs inputs = inputs_of(app_, *now, watch.draws.args);
  session_.files_ = watch.files;
  const auto drawn =
      app_.dispatch_beside(session_, watch.draws.command, watch.draws.args, progress);
  session_.files_ = nullptr;
  if (!drawn.ok()) {
    if (!progress.cancelled()) told(is_it, "failed", drawn.error().sentence());
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    for (Watch& w : watches_)
      if (w.status.number == number) w.inputs = std::move(inputs);
  }
  told(is_it, "current", "");
}

}  // namespace robomosp::ioci
