// SPDX-License-Identifier: Apache-2.0
#include "remote/client_host.h"

#include <cctype>

#include "kernel/text.h"

namespace robomosp::remote {
namespace {

/// How long a command tries to connect again [s].
constexpr double kReconnect = 5;
/// Deeper arguments are refused by the connection.
constexpr int kDeepestValue = 100;

class UserProgress final : public Progress {
 public:
  explicit UserProgress(const ioci::Session& user) : user_(user) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return user_.interrupted(); }

 private:
  const ioci::Session& user_;
};

std::string text_of(const Map& m, std::string_view name) {
  const Value* v = m.find(name);
  return v && v->as_string() ? *v->as_string() : std::string();
}

Schema schema_of(const Value* rows) {
  Schema out;
  if (!rows || !rows->as_list()) return out;
  for (const Value& row : *rows->as_list()) {
    const Map* m = row.as_map();
    if (!m) continue;
    ParamSpec& p = out.emplace_back();
    p.name = text_of(*m, "name");
    p.type = text_of(*m, "type");
    p.unit = text_of(*m, "unit");
    p.doc = text_of(*m, "doc");
    if (const Value* choices = m->find("choices"); choices && choices->as_list())
      for (const Value& one : *choices->as_list())
        if (one.as_string()) p.choices.push_back(*one.as_string());
  }
  return out;
}

Value sent_at(const Value& value, int depth, const std::function<Value(const Handle&)>& of_handle) {
  if (const Handle* h = value.as_handle()) return of_handle(*h);
  if (depth > kDeepestValue) return value;
  if (const List* list = value.as_list()) {
    List out;
    out.reserve(list->size());
    for (const Value& one : *list) out.push_back(sent_at(one, depth + 1, of_handle));
    return out;
  }
  const Map* map = value.as_map();
  if (!map) return value;
  Map out;
  for (const auto& [key, one] : *map) out.append(key, sent_at(one, depth + 1, of_handle));
  return out;
}

}  // namespace

Result<std::unique_ptr<ClientHost>> ClientHost::make(std::unique_ptr<Client> client,
                                                     ioci::Session& user, Warn warn) {
  std::unique_ptr<ClientHost> out(new ClientHost(std::move(client), user, std::move(warn)));
  RMP_TRY(out->begin());
  return out;
}

Result<void> ClientHost::begin() {
  UserProgress progress(user_);
  RMP_TRY_ASSIGN(const Value table, client_->call("ioci.describe", Map{}, false, 0, progress));
  if (!table.as_list())
    return error(ErrorCode::unsupported, "the server does not list its commands",
                 "Use the same version of robomosp on both sides.");
  for (const Value& row : *table.as_list()) {
    const Map* m = row.as_map();
    if (!m || text_of(*m, "name").empty()) continue;
    // Entries stay where they are.
    auto& spec = commands_[text_of(*m, "name")];
    if (!spec) spec = std::make_unique<ioci::CommandSpec>();
    spec->name = text_of(*m, "name");
    spec->classic = text_of(*m, "classic");
    spec->summary = text_of(*m, "summary");
    spec->details = text_of(*m, "details");
    spec->plugin = text_of(*m, "plugin");
    spec->params = schema_of(m->find("params"));
    for (const std::string_view spelling : text::split(spec->classic, '|')) {
      std::string word(text::trim(spelling).substr(0, text::trim(spelling).find(' ')));
      for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      if (!word.empty()) nouns_.insert(std::move(word));
    }
    if (const Value* returns = m->find("returns"); returns && returns->as_map()) {
      const Map& r = *returns->as_map();
      spec->returns = {text_of(r, "type"), text_of(r, "unit"), text_of(r, "doc"),
                       schema_of(r.find("fields"))};
    }
  }
  ++revision_;
  const auto listens = client_->call(
      "server.subscribe", Map{{"topics", List{Value("message")}}, {"severity", "warning"}}, false,
      0, progress);
  if (!listens.ok()) warn_("Warnings of the server are not shown: " + listens.error().sentence());
  return {};
}

Result<Value> ClientHost::ask(const std::string& method, Value params, bool as_job) {
  UserProgress progress(user_);
  if (!client_->is_open()) {
    const std::uint64_t before = client_->generation();
    RMP_TRY(client_->reconnect(kReconnect, progress));
    RMP_TRY(begin());
    warn_(client_->generation() == before ? "The connection was lost and has been restored."
                                          : "Another program answers there now: handles of the "
                                            "previous one are no longer valid.");
  }
  RMP_TRY_ASSIGN(const Value answer, client_->call(method, sent(params), as_job, 0, progress));
  return came(answer);
}

Value ClientHost::sent(const Value& value) const {
  return sent_at(value, 0, [this](const Handle& h) {
    Map inner{{"kind", h.kind}, {"number", static_cast<std::int64_t>(h.number)}};
    const auto known = handles_.find({h.kind, h.number});
    inner.append("generation", known == handles_.end()
                                   ? static_cast<std::int64_t>(client_->generation())
                                   : known->second.generation);
    return Value(Map{{"$handle", std::move(inner)}});
  });
}

Value ClientHost::came(const Value& value) {
  if (const List* list = value.as_list()) {
    List out;
    out.reserve(list->size());
    for (const Value& one : *list) out.push_back(came(one));
    return out;
  }
  const Map* map = value.as_map();
  if (!map) return value;
  const Value* inner = map->size() == 1 ? map->find("$handle") : nullptr;
  if (const Map* h = inner ? inner->as_map() : nullptr) {
    const Value* number = h->find("number");
    const Value* generation = h->find("generation");
    if (number && number->as_int() && *number->as_int() >= 0) {
      Handle out{text_of(*h, "kind"), static_cast<std::uint64_t>(*number->as_int())};
      handles_[{out.kind, out.number}] = {
          text_of(*h, "name"), generation && generation->as_int() ? *generation->as_int() : 0};
      return out;
    }
  }
  Map out;
  for (const auto& [key, one] : *map) out.append(key, came(one));
  return out;
}

Error ClientHost::unknown(std::string_view name) const {
  std::vector<std::string> known;
  for (const auto& [each, spec] : commands_) known.push_back(each);
  return error(ErrorCode::unknown_name,
               client_->options().address.text() + " has no command " + text::quote(name),
               text::did_you_mean(name, known));
}

Result<Value> ClientHost::dispatch(const ioci::CommandSpec& spec, const Map& args) {
  return ask(spec.name, args, false);
}

Result<Handle> ClientHost::dispatch_async(const ioci::CommandSpec& spec, Map args) {
  RMP_TRY_ASSIGN(const Value job, ask(spec.name, std::move(args), true));
  if (!job.as_handle()) return error(ErrorCode::internal, "the job has no handle");
  return *job.as_handle();
}

Result<Value> ClientHost::dispatch_classic(std::string_view line) {
  return ask("ioci.classic", Map{{"line", line}}, false);
}

Result<void> ClientHost::transaction(const std::string&, const std::function<Result<void>()>&) {
  return error(ErrorCode::unsupported,
               "a group of edits cannot be made over a connection, since the connection could be "
               "lost during it",
               "Make single edits; each can be undone. A script run by the server (lua.eval) can "
               "make a group.");
}

std::optional<std::string> ClientHost::name_of(const Handle& h) const {
  const auto known = handles_.find({h.kind, h.number});
  if (known == handles_.end() || known->second.name.empty()) return std::nullopt;
  return known->second.name;
}

std::string ClientHost::describe(const Handle& h) const {
  const auto name = name_of(h);
  return h.kind + (name ? ":" + *name : "") + "#" + std::to_string(h.number);
}

Result<void> ClientHost::may(Effect effect, std::string_view what) const {
  return error(ErrorCode::permission,
               std::string(what) + " " + std::string(phrase(effect)) +
                   ", but a console of another program supports only commands",
               "Use the console of this program, and require \"remote\" there.");
}

void ClientHost::warn(std::string_view, const std::string& sentence) { warn_(sentence); }

void ClientHost::tell_warnings() {
  if (!client_->is_open()) return;
  NoProgress none;
  const auto events = client_->events(0, none);
  if (!events.ok()) return;  // the next command connects again, or says why it cannot
  for (const Value& e : *events) {
    const Map* m = e.as_map();
    if (!m) continue;
    if (const Value* left_out = m->find("left_out"); left_out && left_out->as_int())
      warn_(std::to_string(*left_out->as_int()) + " messages were left out.");
    if (const std::string said = text_of(*m, "text"); !said.empty()) warn_(said);
  }
}

}  // namespace robomosp::remote
