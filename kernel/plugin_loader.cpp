// SPDX-License-Identifier: Apache-2.0
#include "kernel/plugin_loader.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include <robomosp/sdk/files.h>
#include <robomosp/sdk/module.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/threads.h>

#include "kernel/confined_process.h"
#include "kernel/executor.h"
#include "kernel/file_root.h"
#include "kernel/import_process.h"
#include "kernel/interface_adapters.h"
#include "kernel/interface_file.h"
#include "kernel/known_provider.h"
#include "kernel/permit.h"
#include "kernel/plugin_entry.h"
#include "kernel/plugin_faults.h"
#include "kernel/plugin_opening.h"
#include "kernel/plugin_run.h"
#include "kernel/process.h"
#include "kernel/provider_process/doors.h"
#include "kernel/provider_process/proxies.h"
#include "kernel/text.h"

#include <cxxabi.h>
#include <dlfcn.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;

constexpr int kOpenFlags = RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE;
/// Sizes of the rows of the first SDK; later ones are longer.
constexpr std::size_t kPluginSize = offsetof(rmp_plugin, provider_size) + sizeof(std::uint32_t),
                      kProviderSize = offsetof(rmp_provider, create) + sizeof(void*),
                      kParamSize = offsetof(rmp_param, max) + sizeof(double);
/// A table longer than this is a wild number, not a plugin.
constexpr std::uint32_t kMostRows = 4096;

// rmp_host::log carries no context, so the listener has to be reachable without one.
std::atomic<Messages*> g_log_target{nullptr};
/// Of the same loader: where providers that ask for another one find it.
std::atomic<const Registry*> g_registry{nullptr};
/// And where code of plugins that runs after their opening is marked.
std::atomic<PluginTrials*> g_trials{nullptr};

void log_from_plugin(std::int32_t severity, const char* source, const char* text) {
  Messages* messages = g_log_target.load();
  if (!messages || !text) return;
  try {
    messages->post(static_cast<Severity>(std::clamp(severity, 0, 3)), "plugin", text,
                   source ? source : "plugin");
  } catch (...) {  // NOLINT: nothing may be thrown into a plugin
  }
}

std::string or_empty(const char* s) { return s ? s : ""; }

class ProgramProgress final : public Progress {
 public:
  explicit ProgramProgress(const rmp_program& program) : program_(program) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override {
    return program_.cancelled && program_.cancelled(program_.context) != 0;
  }

 private:
  const rmp_program& program_;
};

Result<void> run_program(const rmp_program& program) {
  // Fields up to `cancelled` are those of the first SDK.
  if (!RMP_HAS(&program, cancelled) || !program.name || !program.output ||
      (program.argument_count && !program.arguments) || (program.input_size && !program.input))
    return error(ErrorCode::plugin_failed, "its rmp_program is not filled in");
  ProcessSpec spec;
  spec.program = program.name;
  if (spec.program.is_relative()) spec.program = helper_program(program.name);
  for (std::uint32_t i = 0; i < program.argument_count; ++i)
    spec.arguments.emplace_back(or_empty(program.arguments[i]));
  if (program.input_size)
    spec.input = {program.input, static_cast<std::size_t>(program.input_size)};
  spec.seconds = program.seconds;
  spec.memory = program.memory;
  spec.most_output = program.most_output;
  if (program.line)
    spec.line = [&](std::string_view l) { program.line(program.context, l.data(), l.size()); };
  ProgramProgress progress(program);
  // Whether a command starts a program lies with the provider that is chosen, so the table cannot
  // say it; a session that is denied it stays so.
  const Permit* permit = current_permit();
  if (permit && permit->denied.has(Effect::processes)) RMP_TRY(require(Effect::processes));
  // Helper programs read what users name; compilers and the like what the provider wrote itself.
  std::optional<ProcessConfinement> confined;
  if (std::filesystem::path(program.name).is_relative()) {
    RMP_TRY_ASSIGN(ProcessConfinement made, ProcessConfinement::apply(spec));
    confined.emplace(std::move(made));
  }
  const PermitScope own(nullptr);
  RMP_TRY_ASSIGN(const std::string output, run_process(spec, progress));
  program.output(program.context, output.data(), output.size());
  return {};
}

void say(char* to, std::uint32_t size, std::string_view sentence) {
  if (!to || size == 0) return;
  const std::size_t n = std::min<std::size_t>(sentence.size(), size - 1);
  std::copy_n(sentence.data(), n, to);
  to[n] = '\0';
}

std::int32_t run_for_plugin(const rmp_program* program, char* error, std::uint32_t error_size) {
  std::string sentence = "it could not be run";
  try {
    const auto done =
        program ? run_program(*program)
                : Result<void>(robomosp::error(ErrorCode::plugin_failed, "no program was given"));
    if (done.ok()) return 0;
    if (done.error().code == ErrorCode::cancelled) return 1;
    sentence = done.error().sentence();
  } catch (const std::exception& e) {  // NOLINT: nothing may be thrown into a plugin
    sentence = e.what();
  }
  say(error, error_size, sentence);
  return 2;
}

/// Providers that ask for providers that ask for them would never come to an end.
constexpr int kDeepestAsking = 16;
thread_local int t_asking = 0;
thread_local bool t_circle = false;  ///< reported by all who asked, not as the reason of a reason
constexpr const char* kCircle = "providers require each other in a cycle";

void* create_for_plugin(const char* interface_id, const char* name, char* error,
                        std::uint32_t error_size) {
  struct Deeper {
    Deeper() { ++t_asking; }
    ~Deeper() {
      if (--t_asking == 0) t_circle = false;
    }
  } deeper;
  try {
    const Registry* registry = g_registry.load();
    if (!registry || !interface_id) {
      say(error, error_size, "there is no registry of providers");
      return nullptr;
    }
    if (t_asking > kDeepestAsking) {
      t_circle = true;
      say(error, error_size, kCircle);
      return nullptr;
    }
    auto made = registry->create_raw(interface_id, name ? name : "");
    if (made.ok()) return *made;
    say(error, error_size, t_circle ? kCircle : made.error().sentence());
  } catch (const std::exception& e) {  // NOLINT: nothing may be thrown into a plugin
    say(error, error_size, e.what());
  }
  return nullptr;
}

void list_for_plugin(const char* interface_id, void* context,
                     void (*take)(void* context, const char* name, const char* tags)) {
  try {
    const Registry* registry = g_registry.load();
    if (!registry || !interface_id || !take) return;
    for (const ProviderInfo& info : registry->list(interface_id))
      if (info.enabled) take(context, info.name.c_str(), text::join(info.tags, ",").c_str());
  } catch (...) {  // NOLINT: nothing may be thrown into a plugin
  }
}

void spread_for_plugin(std::size_t parts, std::size_t threads,
                       void (*part)(void* context, std::size_t i), void* context) {
  if (part) Executor::of_process().spread(parts, threads, [&](std::size_t i) { part(context, i); });
}

std::int32_t file_kind_for_plugin(const char* path) {
  try {
    return path ? static_cast<std::int32_t>(file_kind(path)) : 0;
  } catch (...) {  // NOLINT: nothing may be thrown into a plugin
    return 0;
  }
}

std::int32_t read_for_plugin(const char* path, std::uint64_t most, void* context,
                             void (*take)(void* context, const char* bytes, std::uint64_t size),
                             char* error, std::uint32_t error_size) {
  try {
    if (path && take) {
      const auto bytes = read_permitted(path, most);
      if (bytes.ok()) {
        take(context, bytes->data(), bytes->size());
        return 0;
      }
      say(error, error_size, bytes.error().message);
    }
  } catch (const std::exception& e) {  // NOLINT: nothing may be thrown into a plugin
    say(error, error_size, e.what());
  }
  return 2;
}

const void* extension_for_plugin(const char* id) {
  if (id && std::string_view(id) == RMP_FILES) {
    static_assert(static_cast<int>(FileKind::file) == 1 && static_cast<int>(FileKind::folder) == 2);
    static const rmp_files files = {sizeof(rmp_files), &file_kind_for_plugin, &read_for_plugin};
    return &files;
  }
  if (!id || std::string_view(id) != RMP_THREADS) return nullptr;
  static const rmp_threads threads = {sizeof(rmp_threads),
                                      static_cast<std::uint32_t>(Executor::of_process().cores()),
                                      &spread_for_plugin};
  return &threads;
}

const rmp_host kHost = {sizeof(rmp_host),   RMP_SDK_VERSION,  &log_from_plugin,     &run_for_plugin,
                        &create_for_plugin, &list_for_plugin, &extension_for_plugin};

const FaultCodes kPluginCodes{
    {"plugin.not_found", ErrorCode::not_found, "There is no plugin file of that name."},
    {"plugin.cannot_open", ErrorCode::plugin_refused, "A plugin file cannot be opened."},
    {"plugin.refused", ErrorCode::plugin_refused,
     "A plugin file was opened and rejected, or ended the process that tried it."},
    {"plugin.left_out", ErrorCode::plugin_refused,
     "A provider or command of a plugin was left out."},
    {"provider.failed", ErrorCode::plugin_failed, "A plugin cannot make one of its providers."},
};

Error refused(std::string message, std::string hint, const char* code = "plugin.refused") {
  return error_of(make_fault(code, std::move(message), std::move(hint)));
}

/// Faults of remarks, by file and text. Reports of plugins hold text only.
struct KnownRemarks {
  std::mutex mutex;
  std::map<std::pair<std::string, std::string>, Fault> by_remark;  // guarded by mutex
};
KnownRemarks& known_remarks() {
  static KnownRemarks all;
  return all;
}

/// The subject of `f` may name a provider.
void note_left_out(const fs::path& file, const std::string& remark, Fault f) {
  f.severity = Severity::warning;
  f.subject.file = file.string();
  KnownRemarks& all = known_remarks();
  const std::lock_guard lock(all.mutex);
  all.by_remark.insert_or_assign({file.string(), remark}, std::move(f));
}

Fault remark_fault(const fs::path& file, const std::string& remark) {
  KnownRemarks& all = known_remarks();
  const std::lock_guard lock(all.mutex);
  if (const auto at = all.by_remark.find({file.string(), remark}); at != all.by_remark.end())
    return at->second;
  std::string message = remark;
  if (message.ends_with('.')) message.pop_back();
  Fault f =
      make_fault("plugin.left_out", std::move(message), {}, "plugin " + text::quote(file.string()));
  f.severity = Severity::warning;
  f.subject.file = file.string();
  return f;
}

/// The refusal of a file, which all its faults name.
void name_file(Error& e, const fs::path& file) {
  amend(e, [&](Fault& f) {
    if (f.code == "error.plugin_refused") f.code = "plugin.refused";
    if (f.subject.file.empty()) f.subject.file = file.string();
  });
}

std::string demangled(const std::string& symbol) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> name(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), &std::free);
  return status == 0 && name ? name.get() : symbol;
}

/// Refusal 2: the linker's text, and what it means.
Error cannot_open(const fs::path& file, std::string reason) {
  constexpr std::string_view kMissing = ": cannot open shared object file",
                             kUndefined = "undefined symbol: ";
  const std::string own = file.string();
  std::string hint = "Check that it is a shared library of this machine's kind.";
  const auto missing = reason.find(kMissing);
  if (missing != std::string::npos && reason.compare(0, missing, own) != 0) {
    hint = "Install the library " + text::quote(reason.substr(0, missing)) + ", which it needs.";
  } else if (const auto at = reason.find(kUndefined); at != std::string::npos) {
    std::string symbol = reason.substr(at + kUndefined.size());
    symbol = symbol.substr(0, symbol.find_first_of(", \t\n"));
    hint = "Link it with the library that defines " + text::quote(demangled(symbol)) + ".";
  }
  // The where names the file already.
  if (reason.starts_with(own + ": ")) reason.erase(0, own.size() + 2);
  return refused("the dynamic linker cannot open it (" + reason + ")", std::move(hint),
                 "plugin.cannot_open");
}

/// Refusals 3 and 4: no entry, or only one of a newer SDK.
Error no_entry(void* library) {
  for (int version = 9; version >= 2; --version) {
    const std::string name = "rmp_plugin_entry_v" + std::to_string(version);
    if (::dlsym(library, name.c_str()))
      return refused(
          "it was built with a newer SDK (entry v" + std::to_string(version) +
              "); this program offers v1",
          std::string("Rebuild it with SDK ") + RMP_SDK_VERSION + " or update this program.");
  }
  return refused(
      "it is not a robomosp plugin: it does not export rmp_plugin_entry_v1",
      "Build it with robomosp_add_plugin() and RMP_PLUGIN, or take it out of the plugin folder.");
}

/// Refusal 5: which part of the ABI tags differs.
Error tag_differs(std::string_view theirs) {
  const std::string_view ours = RMP_ABI_TAG;
  const auto a = text::split(theirs, ';'), b = text::split(ours, ';');
  std::string differing;
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    const std::string_view x = i < a.size() ? a[i] : "nothing", y = i < b.size() ? b[i] : "nothing";
    if (x == y) continue;
    if (!differing.empty()) differing += ", ";
    differing += std::string(x) + " instead of " + std::string(y);
  }
  return refused("its ABI tag " + text::quote(theirs) + " differs from this program's " +
                     text::quote(ours) + ": " + differing,
                 std::string("Rebuild it with SDK ") + RMP_SDK_VERSION +
                     ", libstdc++ with its new strings, and without debug mode.");
}

/// The entry called behind a wall; checks all that can be checked without running more of it.
Result<const rmp_plugin*> call_entry(rmp_plugin_entry_fn entry) {
  constexpr const char* kReport = "Report it to the plugin's author.";
  const rmp_plugin* plugin = nullptr;
  try {
    plugin = entry();
  } catch (const std::exception& e) {
    return refused(std::string("its entry function threw: ") + e.what(), kReport);
  } catch (...) {
    return refused("its entry function threw an unknown exception", kReport);
  }
  if (!plugin) return refused("its entry function returned nothing", kReport);
  if (!RMP_HAS(plugin, provider_size))
    return refused("its rmp_plugin has " + std::to_string(plugin->struct_size) +
                       " bytes; at least " + std::to_string(kPluginSize) + " are needed",
                   "Set struct_size = sizeof(rmp_plugin), or use the RMP_PLUGIN macro.");
  const std::string tag = or_empty(plugin->abi_tag);
  if (tag != RMP_ABI_TAG) return tag_differs(tag);
  if (!plugin->id || !*plugin->id)
    return refused("it has no id", "Give RMP_PLUGIN a reverse-domain id.");
  if (plugin->provider_count > kMostRows || (plugin->provider_count && !plugin->providers) ||
      (plugin->provider_count && plugin->provider_size < kProviderSize))
    return refused(
        "its provider table is broken (" + std::to_string(plugin->provider_count) + " rows)",
        kReport);
  return plugin;
}

/// `robomosp.ik` of "robomosp.ik/1"
std::string_view without_revision(std::string_view interface_id) {
  return interface_id.substr(0, interface_id.find('/'));
}

/// Refusal 6: why this program cannot use that interface.
std::string unknown_interface(const std::string& id) {
  for (const std::string& known : known_interfaces())
    if (without_revision(known) == without_revision(id))
      return "this program knows " + text::quote(known) + ", not " + text::quote(id);
  return "this program knows no interface " + text::quote(id) + "; it knows " +
         text::enumerate(known_interfaces());
}

Registry::Create creator(const rmp_provider& row, std::string label) {
  return [row = &row, label = std::move(label)]() { return make_provider(*row, &kHost, label); };
}
/// Names of the parameters of any provider, for those that others ask for.
std::vector<std::string> parameter_names(std::string_view interface_id, std::string_view name) {
  std::vector<std::string> out;
  const Registry* registry = g_registry.load();
  const auto info =
      registry ? known_provider(*registry, interface_id, name) : Result<ProviderInfo>(Error{});
  if (info.ok())
    for (const ParamSpec& p : info->schema) out.push_back(p.name);
  return out;
}

std::vector<std::string> tag_list(const char* tags) {
  std::vector<std::string> words;
  for (const std::string_view word : text::split(tags ? tags : "", ','))
    if (!text::trim(word).empty()) words.emplace_back(text::trim(word));
  return words;
}

bool is_file(const fs::path& p) {
  std::error_code ignored;
  return fs::is_regular_file(p, ignored);
}

/// Absolute and free of symbolic links where it can be had.
fs::path resolved(const fs::path& p) {
  std::error_code failed;
  const fs::path real = fs::canonical(p, failed);
  return failed ? p : real;
}

void append_unique(std::vector<fs::path>& path, const fs::path& folder) {
  if (!folder.empty() && std::find(path.begin(), path.end(), folder) == path.end())
    path.push_back(folder);
}

/// Where the program's own plugins are installed.
fs::path shipped_folder() {
  return executable_folder().parent_path() / ROBOMOSP_LIBDIR / "robomosp" / "plugins";
}

/// Registers one row, or says in `report` why not.
/// Importers that read in a process of their own, around those that `create` makes.
Registry::Create in_process(Registry::Create create, const ProviderInfo& info, bool only_confined) {
  ImportProcess who{info.origin, info.name, {}, &log_from_plugin, only_confined};
  for (const ParamSpec& p : info.schema) who.params.push_back(p.name);
  return [create = std::move(create), who = std::move(who)]() -> Result<void*> {
    RMP_TRY_ASSIGN(void* made, create());
    return static_cast<void*>(
        importer_in_process(std::unique_ptr<Importer>(static_cast<Importer*>(made)), who)
            .release());
  };
}

/// What a row says, wherever it was read.
struct Row {
  std::string interface_id, name, summary, tags;
  std::vector<rmp_param> params;  ///< their texts live elsewhere
  std::string fault;
};

/// `create` makes it by its label and the names of its parameters.
template <class Create>
void register_provider(Registry& registry, std::uint32_t index, const Row& row,
                       PluginReport& report, bool is_apart, Create&& create) {
  const auto skip = [&](const std::string& why) {
    const std::string which = row.name.empty() ? "provider number " + std::to_string(index + 1)
                                               : "provider " + text::quote(row.name);
    const char last = why.back();
    report.remarks.push_back(which + " is skipped: " + why +
                             (last == '.' || last == '?' ? "" : "."));
    Fault f = make_fault("plugin.left_out", which + " is skipped: " + why, {},
                         "plugin " + text::quote(report.file.string()));
    f.subject.provider = row.name;
    f.subject.interface_id = row.interface_id;
    note_left_out(report.file, report.remarks.back(), std::move(f));
  };
  if (row.name.empty()) return skip("it has no name");
  if (row.interface_id.empty()) return skip("it names no interface");
  const std::string usable_as = current_interface(row.interface_id);
  if (usable_as.empty()) return skip(unknown_interface(row.interface_id));
  if (!row.fault.empty()) return skip(row.fault);
  if (is_apart && !apart::interface_wire(usable_as))
    return skip(apart::not_apart(usable_as) + ". Load the plugin with run_in_process = true.");
  auto schema = schema_from(row.params);
  if (!schema.ok()) return skip(schema.error().message);

  ProviderInfo info;
  info.interface_id = usable_as;
  info.name = row.name;
  info.summary = row.summary;
  info.tags = tag_list(row.tags.c_str());
  info.origin = report.file.string();
  info.version = report.version;
  info.schema = std::move(*schema);
  info.shipped = report.shipped;
  Registry::Create made = create(row, info);
  const auto has_tag = [&](const char* tag) {
    return std::find(info.tags.begin(), info.tags.end(), tag) != info.tags.end();
  };
  // One that opens files by itself does so in a process that is kept to the session's folder.
  if (usable_as == Importer::kInterfaceId && (has_tag("process") || !has_tag("confined")))
    made = in_process(std::move(made), info, !is_apart && !has_tag("process"));
  auto added = registry.add(std::move(info), std::move(made));
  if (!added.ok()) return skip(added.error().message);
  report.providers.push_back(row.interface_id + " " + row.name);
}

Row row_of(const rmp_provider& from) {
  Row out{or_empty(from.interface_id),
          or_empty(from.name),
          or_empty(from.summary),
          or_empty(from.tags),
          {},
          {}};
  if (!from.create) out.fault = "it has no create function";
  else if (has_broken_parameters(from)) out.fault = "its parameter table is broken";
  else
    for (std::uint32_t i = 0; i < from.param_count; ++i)
      out.params.push_back(rmp_param_at(from, i));
  return out;
}
/// The texts are borrowed.
Row row_of(const apart::ProviderWire& from) {
  Row out{from.interface_id, from.name, from.summary, from.tags, {}, from.fault};
  const auto text_of = [](const std::string& s) { return s.empty() ? nullptr : s.c_str(); };
  for (const apart::RowWire& r : from.params)
    out.params.push_back({r.name.c_str(), r.type.c_str(), r.unit.c_str(), r.doc.c_str(),
                          r.default_text ? r.default_text->c_str() : nullptr,
                          r.choices ? r.choices->c_str() : nullptr, r.min, r.max, r.flags,
                          text_of(r.label), text_of(r.group)});
  return out;
}

/// Whether a word of PluginRun::only is for this provider.
bool is_meant(std::string_view word, std::string_view interface_id, std::string_view name) {
  if (word == name) return true;
  if (!word.ends_with(name) || word.size() < name.size() + 2) return false;
  word.remove_suffix(name.size());
  if (word.back() != ' ') return false;
  word = text::trim(word);
  const std::string_view plain = without_revision(interface_id);
  return word == interface_id || word == plain || word == plain.substr(plain.find('.') + 1) ||
         current_interface(word) == interface_id;
}

/// Takes the providers of a file away, to be registered again from elsewhere; what adds commands
/// may stay where it is, in the program.
Result<void> leave(Registry& registry, const fs::path& file, bool modules_stay) {
  std::vector<ProviderInfo> own;
  for (ProviderInfo& p : registry.list())
    if (p.origin == file.string()) own.push_back(std::move(p));
  if (modules_stay)
    std::erase_if(own, [](const auto& p) { return p.interface_id == Module::kInterfaceId; });
  for (const ProviderInfo& p : own)
    if (p.interface_id == Module::kInterfaceId)
      return error(ErrorCode::unsupported,
                   "the plugin " + text::quote(file.string()) +
                       " adds commands, which stay where they are until the program ends",
                   "Keep the choice with keep = \"user\", and it holds when the program starts.",
                   "run_in_process");
  for (const ProviderInfo& p : own) registry.remove(p.interface_id, p.name);
  return {};
}

Registry::Create apart_creator(const std::shared_ptr<ProviderProcess>& process, std::uint32_t row,
                               const ProviderInfo& info) {
  std::vector<std::string> params;
  for (const ParamSpec& p : info.schema) params.push_back(p.name);
  return [process, row, id = info.interface_id, name = info.name, params = std::move(params)] {
    return process->create(row, id, name, params);
  };
}

/// Those of a plugin's providers that `run` keeps apart, by their rows; a word that is for none is
/// an error where the user has said it just now, else a remark.
Result<std::map<std::uint32_t, std::string>> chosen_rows(const rmp_plugin& plugin,
                                                         const PluginRun& run, bool is_asked,
                                                         PluginReport& report) {
  std::map<std::uint32_t, std::string> out;
  std::vector<std::string> known;
  for (const std::string& word : run.only) {
    bool is_found = false;
    for (std::uint32_t i = 0; i < plugin.provider_count; ++i) {
      const rmp_provider& row = rmp_provider_at(plugin, i);
      const std::string id = current_interface(or_empty(row.interface_id)),
                        name = or_empty(row.name);
      if (id.empty() || name.empty() || !is_meant(word, id, name)) continue;
      is_found = true;
      if (id == Module::kInterfaceId)
        return error(ErrorCode::unsupported,
                     text::quote(name) + " adds commands, and runs where the plugin does",
                     "Leave it out, or leave providers out for the plugin as a whole.",
                     "providers");
      if (!apart::interface_wire(id))
        return error(ErrorCode::unsupported, apart::not_apart(id), "Leave it out.", "providers");
      out[i] = id + " " + name;
    }
    if (is_found) continue;
    if (known.empty())
      for (std::uint32_t i = 0; i < plugin.provider_count; ++i)
        known.push_back(or_empty(rmp_provider_at(plugin, i).name));
    const std::string what = "the plugin has no provider " + text::quote(word);
    if (is_asked)
      return error(ErrorCode::unknown_name, what, "It has " + text::enumerate(known) + ".",
                   "providers");
    report.remarks.push_back(what + ", which should run in a separate process.");
  }
  return out;
}

/// Opens, checks and registers `file`; every fault ends in the report. What `run` keeps apart is
/// made by a process, which opens the file, too.
Result<void> load_file(Registry& registry, PluginReport& report, const PluginRun& run,
                       bool is_asked, bool modules_stay) {
  RMP_TRY_ASSIGN(const rmp_plugin* plugin, open_plugin(report.file));
  report.id = plugin->id;
  report.version = or_empty(plugin->version);
  report.license = or_empty(plugin->license);
  report.summary = or_empty(plugin->summary);
  report.shipped = report.file.parent_path() == resolved(shipped_folder()) &&
                   report.id.starts_with("org.robomosp.");
  RMP_TRY_ASSIGN(const auto chosen, chosen_rows(*plugin, run, is_asked, report));
  std::shared_ptr<ProviderProcess> process;
  if (!chosen.empty())
    process = std::make_shared<ProviderProcess>(report.file, run.limits, &kHost, &parameter_names);
  for (std::uint32_t i = 0; i < plugin->provider_count; ++i) {
    const rmp_provider& row = rmp_provider_at(*plugin, i);
    if (modules_stay && current_interface(or_empty(row.interface_id)) == Module::kInterfaceId) {
      report.providers.push_back(or_empty(row.interface_id) + " " + or_empty(row.name));
      continue;
    }
    const bool is_apart = chosen.contains(i);
    register_provider(registry, i, row_of(row), report, is_apart,
                      [&](const Row& r, const ProviderInfo& info) -> Registry::Create {
                        if (is_apart) return apart_creator(process, i, info);
                        return creator(row, r.interface_id + " " + r.name);
                      });
  }
  report.loaded = true;
  std::vector<std::string> only;
  for (const auto& [i, name] : chosen) only.push_back(name);
  PluginRuns::of_program().set_process(report.file, process, std::move(only));
  return {};
}

/// The same in a process of the plugin's own; nothing of the file is opened here.
Result<void> load_file_apart(Registry& registry, PluginReport& report, const ApartLimits& limits) {
  const auto process =
      std::make_shared<ProviderProcess>(report.file, limits, &kHost, &parameter_names);
  RMP_TRY_ASSIGN(const apart::PluginWire plugin, process->describe());
  report.id = plugin.id;
  report.version = plugin.version;
  report.license = plugin.license;
  report.summary = plugin.summary;
  report.shipped = report.file.parent_path() == resolved(shipped_folder()) &&
                   report.id.starts_with("org.robomosp.");
  std::uint32_t i = 0;
  for (const apart::ProviderWire& row : plugin.providers) {
    register_provider(
        registry, i, row_of(row), report, true,
        [&](const Row&, const ProviderInfo& info) { return apart_creator(process, i, info); });
    ++i;
  }
  report.loaded = true;
  process->end();  // until somebody needs it
  PluginRuns::of_program().set_process(report.file, process);
  return {};
}

}  // namespace

const std::vector<std::string>& known_interfaces() {
  static const std::vector<std::string> ids = [] {
    std::vector<std::string> all;
    for (const InterfaceEntry* entry : InterfaceFile::all()) all.push_back(entry->id);
    return all;
  }();
  return ids;
}

Result<const rmp_plugin*> open_plugin(const fs::path& file) {
  void* library = ::dlopen(file.c_str(), kOpenFlags);
  if (!library) {
    const char* reason = ::dlerror();
    return cannot_open(file, reason ? reason : "no reason given");
  }
  void* symbol = ::dlsym(library, "rmp_plugin_entry_v1");
  if (!symbol) return no_entry(library);
  return call_entry(reinterpret_cast<rmp_plugin_entry_fn>(symbol));
}

bool has_broken_parameters(const rmp_provider& row) {
  return row.param_count > kMostRows || (row.param_count && !row.params) ||
         (row.param_count && row.param_size < kParamSize);
}

Result<void*> make_provider(const rmp_provider& row, const rmp_host* host,
                            const std::string& label) {
  std::array<char, 512> reason{};
  void* made = row.create(host, reason.data(), static_cast<std::uint32_t>(reason.size()));
  if (made) return adapted(row.interface_id, made);
  reason.back() = '\0';
  const std::string why = reason[0] ? std::string(": ") + reason.data() : " and gave no reason";
  Fault f = make_fault("provider.failed", "provider \"" + label + "\" could not be made" + why,
                       "Choose another provider or see the documentation of this one.");
  f.subject.provider = row.name ? row.name : "";
  f.subject.interface_id = row.interface_id ? row.interface_id : "";
  return error_of(std::move(f));
}

fs::path executable_folder() {
  std::error_code failed;
  const fs::path program = fs::read_symlink("/proc/self/exe", failed);
  return failed ? fs::current_path(failed) : program.parent_path();
}

PluginLoader::PluginLoader(Registry& registry, Messages* messages)
    : registry_(registry), messages_(messages) {
  if (messages_) g_log_target = messages_;
  before_ = g_registry.exchange(&registry_);
}

PluginLoader::~PluginLoader() {
  PluginTrials* trials = trials_.get();
  if (trials) g_trials.compare_exchange_strong(trials, nullptr);
  Messages* mine = messages_;
  if (mine) g_log_target.compare_exchange_strong(mine, nullptr);
  // One that was made for a look only leaves things as they were.
  const Registry* registry = &registry_;
  g_registry.compare_exchange_strong(registry, before_);
}

/// If set, the folders of the user are not searched, as for robomosp-desktop --safe.
constexpr const char* kShippedOnly = "ROBOMOSP_SHIPPED_PLUGINS_ONLY";

std::vector<fs::path> PluginLoader::search_path(const std::vector<fs::path>& given) {
  std::vector<fs::path> path;
  for (const fs::path& folder : given) append_unique(path, folder);
  if (const char* only = std::getenv(kShippedOnly); only && *only) {
    append_unique(path, shipped_folder());
    return path;
  }
  if (const char* listed = std::getenv("ROBOMOSP_PLUGIN_PATH"))
    for (const std::string_view folder : text::split(listed, ':'))
      append_unique(path, fs::path(folder));
  // What was installed comes before what was dropped into a folder of the user's: a file there adds
  // to the program and takes nothing's place.
  append_unique(path, shipped_folder());
  const char* data_home = std::getenv("XDG_DATA_HOME");
  const char* home = std::getenv("HOME");
  if (data_home && *data_home) append_unique(path, fs::path(data_home) / "robomosp" / "plugins");
  else if (home && *home)
    append_unique(path, fs::path(home) / ".local" / "share" / "robomosp" / "plugins");
  if (home && *home) append_unique(path, fs::path(home) / ".local/lib/robomosp/plugins");
  return path;
}

const PluginReport& PluginLoader::load(std::string_view name_or_path) {
  const fs::path given(name_or_path);
  if (given.has_extension() && is_file(given)) return load_resolved(given, true);
  if (given.has_parent_path()) {
    if (is_file(given)) return load_resolved(given, true);
    return not_found(name_or_path, {});
  }
  const fs::path file_name = given.extension() == ".so" ? given : fs::path(given.string() + ".so");
  for (const fs::path& folder : path_)
    if (is_file(folder / file_name)) return load_resolved(folder / file_name, true);
  return not_found(name_or_path, path_);
}

const PluginReport& PluginLoader::not_found(std::string_view name,
                                            const std::vector<fs::path>& looked_in) {
  PluginReport report;
  report.file = name;
  if (looked_in.empty()) {
    report.refusal =
        refused("there is no plugin file " + text::quote(name),
                "Check the path, or give the plugin's name to look it up.", "plugin.not_found");
  } else {
    std::vector<std::string> folders;
    for (const fs::path& folder : looked_in) folders.push_back(text::quote(folder.string()));
    report.refusal = refused(
        "there is no plugin " + text::quote(name) + "; looked in " + text::enumerate(folders),
        "Check the name, or add its folder with --plugin-path or ROBOMOSP_PLUGIN_PATH.",
        "plugin.not_found");
  }
  name_file(*report.refusal, name);
  return keep(std::move(report));
}

Result<void> PluginLoader::admit(const fs::path& file, bool is_asked) {
  if (!trials_) return {};
  return trials_->admit(file, file.parent_path() == resolved(shipped_folder()), is_asked);
}

Result<void> PluginLoader::try_out(const fs::path& file) {
  auto admitted = admit(resolved(file), true);
  if (admitted.ok()) return {};
  Error e = std::move(admitted).in("plugin " + text::quote(resolved(file).string())).error();
  name_file(e, resolved(file));
  return e;
}

void PluginLoader::remember_failures(const fs::path& state) {
  trials_ = std::make_unique<PluginTrials>(state, trial_seconds_);
  g_trials = trials_.get();
}

const PluginReport& PluginLoader::load_resolved(const fs::path& found, bool is_asked) {
  const fs::path file = resolved(found);
  PluginRuns& runs = PluginRuns::of_program();
  PluginRunScope* scope = PluginRunScope::current();
  const PluginRun run = runs.wished(file);
  const auto is_opened_here = [](const PluginRun& how) {
    return how.in_process || !how.only.empty();
  };
  bool modules_stay = false;
  const auto open = [&](const PluginRun& how, PluginReport& report) -> Result<void> {
    report.file = file;
    if (!how.in_process && how.only.empty()) return load_file_apart(registry_, report, how.limits);
    RMP_TRY(admit(file, is_asked));
    std::optional<PluginTrials::Opening> opening;
    if (trials_) opening.emplace(*trials_, file);
    return load_file(registry_, report, how, scope != nullptr, modules_stay);
  };
  std::optional<PluginRun> before;  // where it ran until now
  for (const PluginReport& known : reports_) {
    if (!known.loaded || known.file != file) continue;
    const PluginRun present = runs.present(file);
    if (!scope || (run.in_process && present.in_process) || (run.only.empty() && run == present))
      return known;
    modules_stay = is_opened_here(present) && is_opened_here(run);
    if (auto left = leave(registry_, file, modules_stay); !left.ok()) {
      scope->refusal = std::move(left).error();
      return known;
    }
    before = present;
    break;
  }
  PluginReport report;
  auto loaded = open(run, report);
  if (!loaded.ok() && before) {
    scope->refusal = std::move(loaded).error().in("plugin " + text::quote(file.string()));
    report = {};
    loaded = open(*before, report);
  }
  if (!loaded.ok()) {
    report.refusal = std::move(loaded).error().in("plugin " + text::quote(file.string()));
    name_file(*report.refusal, file);
  }
  return keep(std::move(report));
}

const PluginReport& PluginLoader::keep(PluginReport report) {
  if (messages_) {
    for (Fault& f : plugin_faults(report)) {
      f.severity = Severity::warning;
      messages_->post(f, "plugin_loader");
    }
  }
  // One report a file: a second try replaces the first.
  std::erase_if(reports_, [&](const PluginReport& r) { return r.file == report.file; });
  reports_.push_back(std::move(report));
  return reports_.back();
}

std::vector<Fault> plugin_faults(const PluginReport& report) {
  if (report.refusal) return faults_of(*report.refusal);
  std::vector<Fault> out;
  for (const std::string& remark : report.remarks) out.push_back(remark_fault(report.file, remark));
  return out;
}

std::shared_ptr<void> mark_opening(const fs::path& file) {
  PluginTrials* trials = g_trials.load();
  return trials ? std::make_shared<PluginTrials::Opening>(*trials, file) : nullptr;
}

void PluginLoader::remark(const fs::path& file, const std::string& sentence) {
  for (PluginReport& report : reports_)
    if (report.file == file) report.remarks.push_back(sentence);
  if (messages_) messages_->post(remark_fault(file, sentence), "plugin_loader");
}

void PluginLoader::load_all() {
  std::set<fs::path> seen;
  for (const fs::path& folder : path_) {
    std::vector<fs::path> files;
    std::error_code failed;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
      if (it->path().extension() == ".so" && is_file(it->path())) files.push_back(it->path());
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files)
      if (const auto [first, is_new] = seen.insert(file.filename()); is_new)
        load_resolved(file, false);
      else if (messages_)
        messages_->post(Severity::info, "plugin_hidden",
                        "plugin " + text::quote(file.string()) +
                            " is not loaded: a file of its name comes before it.",
                        "plugin_loader");
  }
}

}  // namespace robomosp
