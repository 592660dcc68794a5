// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/application.h"

#include <chrono>
#include <cstdlib>
#include <utility>

#include "io/native.h"
#include "ioci/core/chosen_providers.h"
#include "ioci/core/commands.h"
#include "ioci/core/document_providers.h"
#include "ioci/core/kept_plugin_runs.h"
#include "ioci/core/kept_solvers.h"
#include "ioci/core/lua_plugins.h"
#include "ioci/core/modules.h"
#include "ioci/core/origins.h"
#include "ioci/core/room_parts.h"
#include "ioci/core/runs.h"
#include "ioci/core/surroundings.h"
#include "ioci/core/watchers.h"
#include "kernel/executor.h"
#include "kernel/fault.h"
#include "kernel/plugin_run.h"
#include "kernel/text.h"
#include "model/program_kinds.h"
#include "spatial/parallel.h"

namespace robomosp::ioci {
namespace {

constexpr std::size_t kHistoryBytes = std::size_t{256} << 20;

/// A component made of two functions.
class Part final : public Component {
 public:
  explicit Part(std::function<Result<void>()> on_start = {}, std::function<void()> on_stop = {})
      : start_(std::move(on_start)), stop_(std::move(on_stop)) {}
  Result<void> start() override { return start_ ? start_() : Result<void>(); }
  void stop() noexcept override {
    if (stop_) stop_();
  }

 private:
  std::function<Result<void>()> start_;
  std::function<void()> stop_;
};

std::vector<std::filesystem::path> library_path(const ApplicationOptions& options,
                                                const std::filesystem::path& share) {
  if (!options.library.empty()) return options.library;
  std::vector<std::filesystem::path> out;
  if (const char* given = std::getenv("ROBOMOSP_LIBRARY"))
    for (const std::string_view folder : text::split(given, ':'))
      if (!folder.empty()) out.emplace_back(folder);
  if (out.empty()) out.push_back(share / "library");
  return out;
}

/// A journal of fewer bytes is compared with the files when the program starts.
constexpr std::uintmax_t kQuicklyRead = std::uintmax_t{4} << 20;

}  // namespace

Application::Application(ApplicationOptions options)
    : plugins(registry, &messages),
      document(kHistoryBytes, &lock),
      derived(registry),
      origins(std::make_unique<RecordingOrigins>(*this)),
      modules(std::make_unique<Modules>(*this)),
      kept_solvers(std::make_unique<KeptSolvers>(*this)),
      watchers(std::make_unique<RecordingWatchers>(*this)),
      runs(std::make_unique<Runs>()),
      share(executable_folder() / ".." / "share" / "robomosp"),
      options_(std::move(options)) {
  library = library_path(options_, share);
  derived.set_enabled(options_.cache);
  if (options_.cache && !options_.kept_geometry.empty()) {
    FileCache::Options files{.folder = options_.kept_geometry,
                             .limit = options_.kept_geometry_limit};
    files.note = [this](const std::string& what) {
      messages.post(Severity::info, "kept_geometry", what, "cache");
    };
    derived.keep_in(std::make_shared<FileCache>(std::move(files)));
  }
  messages.deliver_after(lock);
  using Name = std::optional<std::string>;
  (void)handle_kinds.add("recording", [this](std::uint64_t number) {
    const auto r = recordings.find(number);
    return r ? Name(r->title) : Name();
  });
  (void)handle_kinds.add("job", [this](std::uint64_t number) {
    const auto status = jobs.status(number);
    return status.ok() ? Name(status->label) : Name();
  });
  (void)handle_kinds.add("run", [this](std::uint64_t number) {
    const auto run = runs->find(number);
    return run ? Name(run->title) : Name();
  });
  spatial::set_spread(
      [](std::size_t parts, std::size_t threads, void (*part)(void*, std::size_t), void* context) {
        Executor::of_process().spread(parts, threads, [&](std::size_t i) { part(context, i); });
      });
  shared_jobs_ = std::shared_ptr<Jobs>(std::make_shared<int>(0), &jobs);
#ifndef NDEBUG
  lock.on_long_hold([this](const std::string& who, std::chrono::nanoseconds took) {
    messages.post(
        Severity::warning, "application_lock",
        "the application lock was held for " +
            std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(took).count()) +
            " ms by " + who + "; please report this",
        "application");
  });
#endif
}

Application::~Application() {
  // Without the lock, and again where what ends, or a job that ends late, asked for more.
  const auto end_kept = [this] {
    for (bool is_over = false; !is_over;) {
      std::map<std::type_index, std::shared_ptr<void>> ending;
      {
        const std::lock_guard guard(kept_mutex_);
        ending.swap(kept_);
      }
      is_over = ending.empty();
    }
  };
  jobs.end();  // their listeners use what is kept
  end_kept();
  watchers->stop();
  shared_jobs_.reset();
  components_.stop_all();
  for (io::ClaimedJournal& restored : restored_journals) restored.discard();
  jobs.end();  // before what their work reads
  end_kept();
}

Result<void> Application::start() {
  const auto add = [this](std::string id, Layer layer, std::vector<std::string> needs,
                          std::function<Result<void>()> on_start = {},
                          std::function<void()> on_stop = {}) {
    return components_.add({std::move(id), layer, std::move(needs)},
                           std::make_unique<Part>(std::move(on_start), std::move(on_stop)));
  };
  using enum Layer;
  RMP_TRY(add("messages", core, {}));
  RMP_TRY(add("registry", core, {"messages"}));
  RMP_TRY(add("jobs", core, {"messages"}, {}, [this] { jobs.cancel_all(); }));
  RMP_TRY(add("spatial", data_processing, {}));
  RMP_TRY(add("model", data_processing, {"spatial"}));
  RMP_TRY(add("robotics", data_processing, {"model"}));
  RMP_TRY(add("motion", data_processing, {"model", "registry"}));
  RMP_TRY(add("plugins", data_processing, {"registry", "messages"}, [this]() -> Result<void> {
    plugins.set_search_path(PluginLoader::search_path(options_.plugin_path));
    if (!options_.plugins) return {};
    plugins.remember_failures();
    PluginRuns::of_program().set_wishes(kept_plugin_runs());
    plugins.load_all();
    in_rooms(&RoomPart::plugins_loaded, *this, PluginLoader::search_path(options_.plugin_path));
    for (const auto& [interface_id, name] : chosen_providers()) {
      const auto set = registry.set_user_default(interface_id, name);
      // It may be that of a script, which runs later.
      if (!set.ok() && lua_plugins(PluginLoader::search_path(options_.plugin_path)).empty())
        messages.post(Severity::warning, "default_missing",
                      "The default that you chose is not there: " + set.error().sentence(),
                      "provider");
    }
    return {};
  }));
  RMP_TRY(add("document", application, {"model"}, [this]() -> Result<void> {
    (void)settings_kind();  // before what lists the kinds
    (void)program_kind();
    (void)controller_kind();
    document.on_commit([this](const document::Commit& commit) { events.publish(commit); });
    kept_solvers->start();
    follow_document_providers(*this);
    in_rooms(&RoomPart::document_started, *this);
    messages.subscribe([this](const Message& m) { events.publish(m); });
    jobs.subscribe([this](const JobStatus& s) {
      events.publish(s);
      if (events.topics() & kSurroundings) kept<Surroundings>().look();
    });
    recordings.observe([this](const recording::RecordingChange& c) { events.publish(c); });
    document.on_commit([this](const document::Commit& commit) {
      if (events.topics() & kSurroundings) kept<Surroundings>().committed(commit);
    });
    document.on_commit([this](const document::Commit&) {
      if (document.forgotten_steps() == 0 || std::exchange(told_forgotten_, true)) return;
      messages.post(Severity::info, "history_forgets",
                    "The oldest steps can no longer be undone: the history takes no more than " +
                        std::to_string(document.history_budget() >> 20) +
                        " MiB (document.history_memory).",
                    "document");
    });
    return {};
  }));
  RMP_TRY(add("recovery", application, {"document", "io"}, [this]() -> Result<void> {
    recovery_folder = options_.recovery;
    if (recovery_folder.empty()) return {};
    std::vector<io::FoundJournal> offered;
    for (io::FoundJournal& found : io::found_journals(recovery_folder)) {
      // Where all is in its files, there is nothing to offer.
      if (found.bytes < kQuicklyRead)
        if (auto held = io::ClaimedJournal::claim(found.file); held.ok())
          if (const auto unsaved = held->unsaved(library); unsaved.ok() && *unsaved == 0) {
            held->discard();
            continue;
          }
      offered.push_back(std::move(found));
    }
    const auto of_when = [](const io::FoundJournal& found) {
      return found.time + " was found (" + std::to_string(found.records) +
             (found.records == 1 ? " record)" : " records)");
    };
    if (offered.size() == 1)
      messages.post(Severity::info, "recovery",
                    "Unsaved work of " + of_when(offered[0]) +
                        ": recovery.restore() loads it, recovery.discard() drops it.",
                    "recovery");
    else if (!offered.empty())
      messages.post(Severity::info, "recovery",
                    "Unsaved work of " + std::to_string(offered.size()) +
                        " runs was found; that of the last, of " + of_when(offered.back()) +
                        ": recovery.restore() loads it, recovery.discard() drops it; "
                        "recovery.list() lists all.",
                    "recovery");
    journal = std::make_unique<io::RecoveryJournal>(
        document, io::JournalOptions{recovery_folder, options_.recovery_interval,
                                     options_.recovery_program, [this](const std::string& what) {
                                       messages.post(Severity::warning, "recovery", what,
                                                     "recovery");
                                     }});
    document.on_commit([this](const document::Commit& commit) {
      if (commit.kind == document::CommitKind::load) return;
      was_edited = true;
      journal->changed();
    });
    return {};
  }));
  RMP_TRY(add("derived", application, {"document", "registry", "robotics"}));
  RMP_TRY(add("io", application, {"document"}));
  RMP_TRY(add("sim", application, {"derived", "motion", "plugins"}));
  RMP_TRY(add("ioci", application, {"document", "derived", "io", "sim", "plugins", "jobs"},
              [this]() -> Result<void> {
                register_commands(commands);
                watchers->start();
                document.on_commit(
                    [this](const document::Commit& commit) { modules->tell_absent(commit); });
                modules->adopt();
                return {};
              }));
  return components_.start_all();
}

Result<std::unique_ptr<Application>> Application::create(ApplicationOptions options) {
  std::unique_ptr<Application> app(new Application(std::move(options)));
  RMP_TRY(app->start());
  return app;
}

std::vector<AnyId> Application::unsaved() const {
  return was_edited ? io::unsaved_records(*document.now(), library) : std::vector<AnyId>();
}

Result<void> Application::keep_unsaved(std::size_t most) {
  if (!journal)
    return error(ErrorCode::io, "there is no folder for unsaved work",
                 "Set HOME or XDG_STATE_HOME.");
  RMP_TRY(journal->keep());
  if (most == 0) return {};
  std::vector<std::filesystem::path> own;  // oldest first, without that of this process
  for (const io::FoundJournal& found : io::found_journals(recovery_folder))
    if (found.program == options_.recovery_program) own.push_back(found.file);
  for (std::size_t i = 0; i + most <= own.size(); ++i)
    if (auto old = io::ClaimedJournal::claim(own[i]); old.ok()) old->discard();
  return {};
}

Result<FileRoot> Application::file_root(const std::filesystem::path& folder) const {
  std::vector<std::filesystem::path> readable = library;
  readable.push_back(share);
  return FileRoot::open(folder, readable);
}

namespace {

constexpr std::string_view kGenerated = "\n\nGenerated from the command table; do not edit.";

}  // namespace

Result<void> write_reference(const CommandTable& table, const std::filesystem::path& folder,
                             const ToJson& to_json) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return error(
        ErrorCode::io,
        "the folder " + text::quote(folder.string()) + " cannot be made: " + failed.message(),
        "Check the path and its permissions.");
  const auto pages = reference_pages(table, to_json);
  for (const auto& [name, page] : pages) RMP_TRY(io::write_file(folder / name, page));
  // Pages of topics that are gone; what somebody wrote by hand stays.
  std::vector<std::filesystem::path> gone;
  for (std::filesystem::directory_iterator it(folder, failed), end; !failed && it != end;
       it.increment(failed)) {
    const auto& path = it->path();
    if (path.extension() != ".md" || pages.contains(path.filename().string())) continue;
    const auto old = io::read_file(path);
    if (old.ok() && old->find(kGenerated) != std::string::npos) gone.push_back(path);
  }
  for (const auto& path : gone) std::filesystem::remove(path, failed);
  return {};
}

}  // namespace robomosp::ioci
