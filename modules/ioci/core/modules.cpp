// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/modules.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "ioci/core/commands.h"
#include "ioci/core/handle_text.h"
#include "kernel/known_provider.h"
#include "kernel/plugin_opening.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

/// A table longer than this is a wild number.
constexpr std::uint32_t kMostRows = 4096;
constexpr std::uint32_t kAllRuns = kModuleRunSimulation | kModuleRunTask | kModuleRunJob;
/// Sizes of the rows of the first SDK that had them; later ones are longer.
constexpr std::size_t kCommandSize = offsetof(ModuleCommand, run) + sizeof(void*),
                      kTableSize = offsetof(ModuleTable, runs) + sizeof(std::uint32_t),
                      kParamSize = offsetof(rmp_param, max) + sizeof(double);

std::string or_empty(const char* s) { return s ? s : ""; }

/// Whatever a module throws, and that it must not hold the lock.
template <class Fn>
auto call_module(const std::string& module, Fn&& fn) -> decltype(fn()) {
  return guarded(module, std::forward<Fn>(fn));
}

Result<Schema> schema_of(const ModuleFields& fields) {
  if (fields.count == 0) return Schema{};
  if (fields.count > kMostRows || !fields.rows || fields.row_size < kParamSize)
    return error(ErrorCode::plugin_refused, "its table of fields is broken");
  rmp_provider table{};
  table.params = fields.rows;
  table.param_count = fields.count;
  table.param_size = fields.row_size;
  return schema_from(table);
}

/// "edits, files_read" as a set.
Result<Effects> effects_of(const char* words) {
  Effects out = Effect::reads;
  for (const std::string_view part : text::split(words ? words : "", ',')) {
    const std::string_view word = text::trim(part);
    if (word.empty()) continue;
    bool is_known = false;
    for (const Effect e : kAllEffects)
      if (to_string(e) == word) {
        out = out | e;
        is_known = true;
      }
    if (is_known) continue;
    std::vector<std::string> known;
    for (const Effect e : kAllEffects) known.emplace_back(to_string(e));
    return error(ErrorCode::plugin_refused,
                 "its effect " + text::quote(word) + " is not one of " + text::enumerate(known));
  }
  return out;
}

bool is_command_name(std::string_view name) {
  const auto is_word = [](std::string_view s) {
    return !s.empty() && s[0] >= 'a' && s[0] <= 'z' && std::all_of(s.begin(), s.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    });
  };
  const auto dot = name.find('.');
  return dot != std::string_view::npos && is_word(name.substr(0, dot)) &&
         is_word(name.substr(dot + 1));
}

Result<CommandSpec> spec_of(const LoadedModule& m, const ModuleCommand& row);

/// Commands that call themselves would never come to an end.
constexpr int kDeepestCalls = 32;
thread_local int t_depth = 0;
struct Deeper {
  Deeper() { ++t_depth; }
  ~Deeper() { --t_depth; }
  Deeper(const Deeper&) = delete;
  Deeper& operator=(const Deeper&) = delete;
};

/// What a command or hook of a module asks of the program.
class HostCall final : public ModuleCall {
 public:
  /// `allowed`: all that it may ask for.
  HostCall(const LoadedModule& module, CommandContext& ctx, std::string work, Effects allowed)
      : module_(module),
        ctx_(ctx),
        work_(std::move(work)),
        session_(ctx.session.name()),
        allowed_(allowed) {}

  Result<ModuleValue> run(std::string_view command, const ModuleValue& arguments) override {
    RMP_TRY(is_here("run"));
    RMP_TRY_ASSIGN(const Value given, from_module(arguments));
    if (!given.is_nil() && !given.as_map())
      return error(ErrorCode::plugin_failed,
                   who() + " gave " + std::string(command) + " no map of arguments", report());
    const CommandSpec* spec = ctx_.app.commands.find(command);
    if (!spec) return std::move(ctx_.app.commands.unknown(command)).in(who());
    if (t_depth >= kDeepestCalls)
      return error(ErrorCode::plugin_failed,
                   "commands of plugins call each other more than " +
                       std::to_string(kDeepestCalls) + " deep",
                   report(), who());
    const Deeper deeper;
    auto result = ctx_.dispatch(command, given.as_map() ? *given.as_map() : Map{});
    if (result.ok()) return to_module(*result);
    Error e = std::move(result).error();
    // Refused where it got there: by what it does at times, which the session itself may do.
    const Effects beyond = spec->sometimes.without(allowed_);
    if (e.code == ErrorCode::permission && !beyond.empty() && !beyond.meets(ctx_.session.denied()))
      e = error(ErrorCode::permission,
                "what called " + spec->name + " may have the effects " + allowed_.text() +
                    " only, and with these arguments " + spec->name + " has others (" +
                    beyond.text() + ")",
                "The plugin's command must declare them.");
    if (e.where.find(who()) != std::string::npos) return e;  // it called itself
    return std::move(e).in(who());
  }
  [[nodiscard]] Result<ModuleValue> setting(std::string_view name) const override {
    RMP_TRY(is_here("setting"));
    RMP_TRY_ASSIGN(const Value value, setting_of(ctx_.snapshot(), module_, name));
    return to_module(value);
  }
  [[nodiscard]] Result<std::string> name(const ModuleValue& reference) const override {
    RMP_TRY(is_here("name"));
    const Handle h{reference.kind(), reference.number()};
    const auto name = ctx_.name_of(h);
    if (name) return *name;
    return error(ErrorCode::stale_handle,
                 reference.type() == ModuleValue::Type::reference
                     ? h.kind + "#" + std::to_string(h.number) + " no longer exists"
                     : "a value that is not a reference has no name",
                 {}, who());
  }
  Result<std::shared_ptr<const RobotModel>> robot_model(const ModuleValue& robot) override {
    RMP_TRY(is_here("robot_model"));
    RMP_TRY_ASSIGN(const Value value, from_module(robot));
    auto handle = ctx_.app.resolve(ctx_.snapshot(), "robot", value);
    if (!handle.ok()) return std::move(handle).error().in(who());
    return model_of(ctx_, Map{{"id", *handle}});
  }
  Progress& progress() override { return ctx_.progress; }
  void say(std::int32_t severity, std::string_view text) override {
    ctx_.app.messages.post(static_cast<Severity>(std::clamp(severity, 0, 3)), "plugin",
                           std::string(text), module_.name);
  }
  [[nodiscard]] std::string_view session() const override { return session_; }

  static std::string report() { return "Report it to the plugin's author."; }

 private:
  /// `plugin "payload", payload.study`
  [[nodiscard]] std::string who() const {
    return "plugin " + text::quote(module_.name) + ", " + work_;
  }
  /// The records that a command works on are its thread's, and so is the permit.
  [[nodiscard]] Result<void> is_here(const char* function) const {
    if (std::this_thread::get_id() == thread_) return {};
    return error(ErrorCode::plugin_failed, who() + " called " + function + " from another thread",
                 report());
  }
  const LoadedModule& module_;
  CommandContext& ctx_;
  const std::string work_, session_;
  const Effects allowed_;
  const std::thread::id thread_ = std::this_thread::get_id();
};

/// The body of a module's command.
Result<Value> run_command(const LoadedModule& m, const std::string& name, const ReturnSpec& returns,
                          Effects effects,
                          Result<ModuleValue> (*run)(const Module&, const ModuleValue&,
                                                     ModuleCall&),
                          CommandContext& ctx, const Map& args) {
  const auto info = known_provider(ctx.app.registry, Module::kInterfaceId, m.name);
  if (info.ok() && !info->enabled)
    return error(
        ErrorCode::unsupported,
        name + " is a command of the plugin " + text::quote(m.name) + ", which is disabled",
        "provider.enable(\"module\", " + text::quote(m.name) + ") enables it again.");
  HostCall call(m, ctx, name, effects);
  const ModuleValue given = to_module(Value(args));
  auto made = call_module(m.name, [&] { return run(*m.module, given, call); });
  if (!made.ok()) {
    Error e = std::move(made).error();
    if (e.where.find(text::quote(m.name)) != std::string::npos) return e;
    return std::move(e).in("plugin " + text::quote(m.name) + ", " + name);
  }
  const auto broken = [&](const std::string& what) {
    return error(ErrorCode::plugin_failed,
                 "plugin " + text::quote(m.name) + ", " + name + ": " + what, HostCall::report());
  };
  auto value = from_module(*made);
  if (!value.ok()) return broken(value.error().message);
  if (const std::string fault = result_fault(returns, *value); !fault.empty()) return broken(fault);
  if (const Handle* h = value->as_handle())
    if (const auto there = ctx.app.resolve(ctx.snapshot(), "any", *h); !there.ok())
      return broken("it gave a reference to what is not there (" + there.error().message + ")");
  return value;
}

Result<CommandSpec> spec_of(const LoadedModule& m, const ModuleCommand& row) {
  CommandSpec spec;
  spec.name = or_empty(row.name);
  spec.summary = or_empty(row.summary);
  spec.details = or_empty(row.details);
  spec.example = or_empty(row.example);
  spec.plugin = m.name;
  if (!is_command_name(spec.name))
    return error(ErrorCode::plugin_refused,
                 "its name is not topic.verb of lower-case letters, digits and _");
  if (!row.run) return error(ErrorCode::plugin_refused, "it has no function to run");
  RMP_TRY_ASSIGN(spec.params, schema_of(row.params));
  RMP_TRY_ASSIGN(spec.returns.fields, schema_of(row.result_fields));
  RMP_TRY_ASSIGN(spec.effect, effects_of(row.effects));
  RMP_TRY_ASSIGN(spec.sometimes, effects_of(row.sometimes));
  spec.sometimes = spec.sometimes.without(spec.effect);
  spec.returns.type = or_empty(row.result_type);
  spec.returns.unit = or_empty(row.result_unit);
  spec.returns.doc = or_empty(row.result_doc);
  static constexpr std::array<std::string_view, 12> kResults{"nil",    "bool",   "int",  "real",
                                                             "string", "real[]", "vec3", "pose",
                                                             "matrix", "list",   "map",  "any"};
  const bool is_word = spec.returns.type.find_first_of(" (<{:") == std::string::npos;
  if (is_word ? spec.returns.type != "handle" &&
                    std::find(kResults.begin(), kResults.end(), spec.returns.type) == kResults.end()
              : !type_fault(spec.returns.type).empty())
    return error(ErrorCode::plugin_refused,
                 "its result has the unknown type " + text::quote(spec.returns.type));
  for (std::size_t i = 0; i < spec.params.size(); ++i)
    if (spec.params[i].name == "id" && (i != 0 || !spec.params[i].type.starts_with("ref:")))
      return error(ErrorCode::plugin_refused,
                   "its parameter id is not the first, or not a ref:<kind>");
  if (!spec.params.empty() && spec.params.front().name == "id" &&
      !kinds_include(std::string_view(spec.params.front().type).substr(4),
                     spec.name.substr(0, spec.name.find('.'))))
    return error(ErrorCode::plugin_refused, "its parameter id is a " +
                                                spec.params.front().type.substr(4) +
                                                ", which is not the topic of its name");
  if (const std::string fault = fault_of(spec); !fault.empty() && fault != "nothing to run")
    return error(ErrorCode::plugin_refused, fault);
  spec.plugged = [&m, name = spec.name, returns = spec.returns,
                  effects = spec.effect | spec.sometimes | Effect::reads,
                  run = row.run](CommandContext& ctx, const Map& args) {
    return run_command(m, name, returns, effects, run, ctx, args);
  };
  return spec;
}

/// A row of a module's commands; what its plugin did not know of is as in a new one.
ModuleCommand row_at(const ModuleTable& table, std::uint32_t i) {
  ModuleCommand row;
  std::memcpy(static_cast<void*>(&row),
              reinterpret_cast<const char*>(table.commands) +
                  static_cast<std::size_t>(i) * table.command_size,
              std::min<std::size_t>(table.command_size, sizeof row));
  return row;
}

std::string skipped(const std::string& command, const std::string& why) {
  return "command " + text::quote(command) + " is skipped: " + why +
         (why.back() == '.' || why.back() == '?' ? "" : ".");
}

}  // namespace

Result<LoadedModule> read_module(const ProviderInfo& info, std::shared_ptr<const Module> module) {
  LoadedModule m{info.name, info.origin, info.version, info.summary, std::move(module), {}, 0};
  const auto refused = [&](const std::string& why) {
    return error(ErrorCode::plugin_refused, "module " + text::quote(m.name) + " " + why,
                 HostCall::report());
  };
  auto read =
      call_module(m.name, [&]() -> Result<const ModuleTable*> { return &m.module->table(); });
  if (!read.ok()) return std::move(read).error();
  const ModuleTable* t = *read;
  if (!t || !RMP_HAS(t, runs) || t->struct_size < kTableSize || t->command_count > kMostRows ||
      (t->command_count && (!t->commands || t->command_size < kCommandSize)))
    return refused("has a broken table");
  auto settings = schema_of(t->settings);
  if (!settings.ok()) return refused("has a bad setting: " + settings.error().message);
  m.settings = std::move(*settings);
  static constexpr std::array<std::string_view, 6> kTypes{"bool",   "int",  "real",
                                                          "string", "enum", "real[]"};
  for (const ParamSpec& s : m.settings) {
    if (std::find(kTypes.begin(), kTypes.end(), plain_type(s.type)) == kTypes.end())
      return refused("has the setting " + text::quote(s.name) + " of type " + text::quote(s.type) +
                     "; settings are bool, int, real, string, enum or real[]");
    if (!s.default_value)
      return refused("has the setting " + text::quote(s.name) + " without a default");
  }
  if (t->runs & ~kAllRuns) return refused("subscribes to runs unknown to this program");
  m.runs = t->runs;
  return m;
}

std::vector<CommandSpec> commands_of(const LoadedModule& m, std::vector<std::string>& faults) {
  std::vector<CommandSpec> out;
  const ModuleTable& t = m.module->table();
  for (std::uint32_t i = 0; i < t.command_count; ++i) {
    const ModuleCommand row = row_at(t, i);
    auto spec = spec_of(m, row);
    if (spec.ok()) out.push_back(std::move(*spec));
    else faults.push_back(skipped(or_empty(row.name), spec.error().message));
  }
  return out;
}

std::vector<std::string> module_faults(const Registry& registry, const ProviderInfo& info,
                                       const CommandTable& commands) {
  std::vector<std::string> faults;
  auto made = registry.create<Module>(info.name);
  if (!made.ok()) return {made.error().sentence()};
  auto read = read_module(info, *made);
  if (!read.ok()) return {read.error().sentence()};
  std::set<std::string> own;
  for (const CommandSpec& spec : commands_of(*read, faults)) {
    const CommandSpec* known = commands.find(spec.name);
    if (!own.insert(spec.name).second) faults.push_back(skipped(spec.name, "it appears twice"));
    else if (known && known->plugin != info.name)
      faults.push_back(skipped(
          spec.name, known->plugin.empty()
                         ? std::string("the program has a command of that name")
                         : "plugin " + text::quote(known->plugin) + " has a command of that name"));
  }
  return faults;
}

std::vector<std::string> Modules::adopt() {
  std::vector<std::string> fresh;
  for (const ProviderInfo& info : app_.registry.list(Module::kInterfaceId)) {
    {
      const std::shared_lock lock(mutex_);
      const auto is_it = [&](const auto& m) { return m->name == info.name; };
      if (std::any_of(all_.begin(), all_.end(), is_it) ||
          std::find(failed_.begin(), failed_.end(), info.name) != failed_.end())
        continue;
    }
    const PermitScope own(nullptr);  // the plugin was let in; its tables are constant
    const auto marked = mark_opening(info.origin);
    auto made = app_.registry.create<Module>(info.name);
    auto read = made.ok() ? read_module(info, *made) : Result<LoadedModule>(made.error());
    if (!read.ok()) {
      app_.plugins.remark(info.origin, read.error().sentence());
      const std::unique_lock lock(mutex_);
      failed_.push_back(info.name);
      continue;
    }
    auto module = std::make_unique<const LoadedModule>(std::move(*read));
    std::vector<std::string> faults;
    for (CommandSpec& spec : commands_of(*module, faults)) {
      const std::string name = spec.name;
      if (auto added = app_.commands.add_plugged(std::move(spec)); !added.ok())
        faults.push_back(skipped(name, added.error().message));
    }
    for (const std::string& fault : faults) app_.plugins.remark(info.origin, fault);
    watched_.fetch_or(module->runs, std::memory_order_relaxed);
    fresh.push_back(info.name);
    const std::unique_lock lock(mutex_);
    all_.push_back(std::move(module));
  }
  return fresh;
}

const LoadedModule* Modules::find(std::string_view name) const {
  const std::shared_lock lock(mutex_);
  for (const auto& m : all_)
    if (m->name == name) return m.get();
  return nullptr;
}

std::vector<const LoadedModule*> Modules::list() const {
  const std::shared_lock lock(mutex_);
  std::vector<const LoadedModule*> out;
  for (const auto& m : all_) out.push_back(m.get());
  return out;
}

// --- hooks ---------------------------------------------------------------------------------

ModuleRunScope::ModuleRunScope(Modules& modules, CommandContext& ctx, const CommandSpec& spec,
                               const Map& args, std::uint32_t kind, bool is_job)
    : modules_(modules), ctx_(ctx), spec_(spec), args_(to_module(Value(args))) {
  notice_.kind = kind;
  notice_.number = ++modules.runs_;
  notice_.command = spec.name;
  notice_.session = ctx.session.name();
  notice_.arguments = &args_;
  notice_.is_job = is_job;
}

/// A hook looks on: what it asks for may read, and nothing else.
template <class Call>
void ModuleRunScope::with(const LoadedModule& m, const std::string& work, Call&& call) {
  const Permit permit{ctx_.session.name(), work, Effect::reads, ctx_.session.denied(), false};
  const PermitScope permitted(&permit);
  const Effects before = std::exchange(ctx_.allowed_, Effects(Effect::reads));
  HostCall host(m, ctx_, work, Effect::reads);
  call(host);
  ctx_.allowed_ = before;
}

Result<void> ModuleRunScope::begin() {
  for (const LoadedModule* m : modules_.list()) {
    if ((m->runs & notice_.kind) == 0) continue;
    const auto info = known_provider(ctx_.app.registry, Module::kInterfaceId, m->name);
    if (info.ok() && !info->enabled) continue;
    Result<void> let;
    with(*m, "the hook before " + spec_.name, [&](ModuleCall& host) {
      let = call_module(m->name, [&] { return m->module->before_run(notice_, host); });
    });
    if (!let.ok())
      return std::move(let).error().in(spec_.name + " was refused by the plugin " +
                                       text::quote(m->name));
    asked_.push_back(m);
  }
  return {};
}

void ModuleRunScope::end(const Result<Value>& result) {
  ModuleRunEnd end;
  end.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  const std::string sentence = result.ok() ? std::string() : result.error().sentence();
  const ModuleValue value = result.ok() ? to_module(*result) : ModuleValue();
  end.error = sentence;
  end.result = &value;
  for (const LoadedModule* m : asked_) {
    Result<void> heard;
    with(*m, "the hook after " + spec_.name, [&](ModuleCall& host) {
      heard = call_module(m->name, [&] { return m->module->after_run(notice_, end, host); });
    });
    if (!heard.ok())
      ctx_.app.messages.post(Severity::warning, "plugin",
                             "plugin " + text::quote(m->name) + ", after " + spec_.name + ": " +
                                 heard.error().sentence(),
                             m->name);
  }
}

}  // namespace robomosp::ioci
