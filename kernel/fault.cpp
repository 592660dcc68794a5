// SPDX-License-Identifier: Apache-2.0
#include "kernel/fault.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <unordered_map>
#include <utility>

#include "kernel/check.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

/// Causes behind causes that are compared, written or read.
constexpr int kMostCauses = 8;
/// Entries of one list that are read from a peer.
constexpr std::size_t kMostRead = 1000;

/// Faults of errors by Error::fault_set. Errors are returned by plugins too, so their layout is
/// fixed and cannot hold a pointer; what an error carries is kept here instead, of many errors the
/// newest.
class FaultSets {
 public:
  using Set = std::shared_ptr<const std::vector<Fault>>;
  static FaultSets& all() {
    static FaultSets sets;
    return sets;
  }
  struct Kept {
    std::vector<Fault> faults;
    /// Error::where when the faults were made, which theirs have already.
    std::string where;
  };
  void keep(Error& e, std::vector<Fault> faults, std::string where) {
    auto kept = std::make_shared<const Kept>(Kept{std::move(faults), std::move(where)});
    std::vector<std::shared_ptr<const Kept>> old;  // destroyed without the lock
    const std::lock_guard lock(mutex_);
    std::uint32_t number = 0;
    do {
      // Numbers that no padding is likely to hold, each once in 2^32.
      number = ++count_ * 2654435769U;
    } while (number == 0 || by_number_.contains(number));
    faults_ += kept->faults.size();
    by_number_.emplace(number, std::move(kept));
    order_.push_back(number);
    while (faults_ > kMostKept && order_.size() > 1) {
      const auto oldest = by_number_.find(order_.front());
      faults_ -= oldest->second->faults.size();
      old.push_back(std::move(oldest->second));
      by_number_.erase(oldest);
      order_.pop_front();
    }
    e.fault_set = number;
  }
  Set find(const Error& e) {
    if (e.fault_set == 0) return nullptr;
    const std::lock_guard lock(mutex_);
    const auto at = by_number_.find(e.fault_set);
    return at == by_number_.end() ? nullptr : Set(at->second, &at->second->faults);
  }
  /// Kept::where of an error's faults.
  std::string where_of(const Error& e) {
    if (e.fault_set == 0) return {};
    const std::lock_guard lock(mutex_);
    const auto at = by_number_.find(e.fault_set);
    return at == by_number_.end() ? std::string() : at->second->where;
  }

 private:
  static constexpr std::size_t kMostKept = 20'000;  ///< faults, about 20 MB
  std::mutex mutex_;
  std::uint32_t count_ = 0;  // guarded by mutex_, as all below
  std::unordered_map<std::uint32_t, std::shared_ptr<const Kept>> by_number_;
  std::deque<std::uint32_t> order_;
  std::size_t faults_ = 0;
};

struct CodeTable {
  std::mutex mutex;
  std::map<std::string_view, FaultCode> rows;  // guarded by mutex
};
CodeTable& code_table() {
  static CodeTable all;
  return all;
}

const FaultCodes kFaultCodes{
    {"error.invalid_argument", ErrorCode::invalid_argument,
     "A value has the wrong type, unit, range or length."},
    {"error.usage", ErrorCode::usage, "The command line or the form of the call is wrong."},
    {"error.unknown_name", ErrorCode::unknown_name,
     "Nothing has that name: command, record, provider, parameter or field."},
    {"error.not_found", ErrorCode::not_found, "A file or folder is missing."},
    {"error.syntax", ErrorCode::syntax, "A text does not follow its grammar."},
    {"error.io", ErrorCode::io, "The operating system refused to read or write."},
    {"error.conflict", ErrorCode::conflict,
     "An edit contradicts the document: a cycle, a name used twice, a record still referred to."},
    {"error.stale_handle", ErrorCode::stale_handle, "A handle names a record that was removed."},
    {"error.unreachable", ErrorCode::unreachable, "There is no solution for the target."},
    {"error.plugin_refused", ErrorCode::plugin_refused, "A plugin file was not accepted."},
    {"error.plugin_failed", ErrorCode::plugin_failed,
     "A provider threw an exception, returned NaN or broke its contract."},
    {"error.permission", ErrorCode::permission, "The session may not do that."},
    {"error.cancelled", ErrorCode::cancelled, "The user stopped it."},
    {"error.unsupported", ErrorCode::unsupported, "This provider or version cannot do it."},
    {"error.internal", ErrorCode::internal, "A defect of the program."},
    {"error.script_failed", ErrorCode::script_failed, "A script raised an error."},
};

std::string sentence_of(std::string_view where, std::string_view message, std::string_view hint) {
  Error e;
  e.message = message;
  e.where = where;
  e.hint = hint;
  return e.sentence();
}

Fault from_text(const Error& e) {
  Fault f;
  f.code = "error." + std::string(to_string(e.code));
  f.error = e.code;
  f.message = e.message;
  f.where = e.where;
  f.hint = e.hint;
  return f;
}

/// `outer, inner`, each of which may be empty.
std::string joined_places(const std::string& outer, const std::string& inner) {
  return outer.empty() ? inner : inner.empty() ? outer : outer + ", " + inner;
}

/// The context that was added to an error since its faults were made.
std::string outer_place(const Error& e, const std::string& own) {
  if (own.empty() || !e.where.ends_with(own)) return e.where;
  std::string outer = e.where.substr(0, e.where.size() - own.size());
  if (outer.ends_with(", ")) outer.resize(outer.size() - 2);
  return outer;
}

bool equal_faults(const Fault& a, const Fault& b, int depth) {
  if (a.code != b.code || a.error != b.error || a.severity != b.severity ||
      a.message != b.message || a.where != b.where || a.hint != b.hint || a.subject != b.subject ||
      a.extent != b.extent || a.witness != b.witness || a.remedies != b.remedies ||
      !a.cause != !b.cause)
    return false;
  return !a.cause || depth >= kMostCauses || equal_faults(*a.cause, *b.cause, depth + 1);
}

// --- as maps ---------------------------------------------------------------------------------

void put_member(Map& m, const char* key, const std::string& text) {
  if (!text.empty()) m.append(key, Value(text));
}
void put_member(Map& m, const char* key, std::size_t number) {
  if (number > 0) m.append(key, Value(number));
}
void put_member(Map& m, const char* key, const std::optional<double>& number) {
  if (number) m.append(key, Value(*number));
}
void put_member(Map& m, const char* key, const Handle& handle) {
  if (handle.number != 0) m.append(key, Value(handle));
}
void put_member(Map& m, const char* key, const std::vector<std::string>& texts) {
  if (!texts.empty()) m.append(key, Value(List(texts.begin(), texts.end())));
}
void put_member(Map& m, const char* key, Map inner) {
  if (!inner.empty()) m.append(key, Value(std::move(inner)));
}
void put_member(Map& m, const char* key, List inner) {
  if (!inner.empty()) m.append(key, Value(std::move(inner)));
}

/// Paths into records have one form, "links.2.a": that of expressions, outlines and origins.
std::string record_path(std::string_view path) {
  std::string out;
  out.reserve(path.size());
  for (const char c : path) {
    if (c == '[') out += '.';
    else if (c != ']') out += c;
  }
  return out;
}

Map map_of(const FaultSubject& s) {
  Map m;
  put_member(m, "record", s.record);
  put_member(m, "name", s.name);
  put_member(m, "path", record_path(s.path));
  put_member(m, "command", s.command);
  put_member(m, "argument", s.argument);
  put_member(m, "provider", s.provider);
  put_member(m, "interface", s.interface_id);
  put_member(m, "file", s.file);
  put_member(m, "line", s.line);
  put_member(m, "column", s.column);
  put_member(m, "end_line", s.end_line);
  put_member(m, "end_column", s.end_column);
  return m;
}

Map map_of(const FaultExtent& e) {
  Map m;
  put_member(m, "first", e.first);
  put_member(m, "last", e.last);
  put_member(m, "worst", e.worst);
  put_member(m, "from", e.from);
  put_member(m, "to", e.to);
  put_member(m, "at", e.at);
  put_member(m, "segment", e.segment);
  put_member(m, "step", e.step);
  put_member(m, "motion", e.motion);
  return m;
}

Map map_of(const FaultWitness& w) {
  Map m;
  put_member(m, "scene", w.scene);
  put_member(m, "robot", w.robot);
  if (!w.q.empty()) m.append("q", Value(NumericArray(w.q)));
  List joints, points;
  for (const FaultJoint& j : w.joints) {
    Map one;
    put_member(one, "name", j.name);
    put_member(one, "number", j.number);
    put_member(one, "value", j.value);
    put_member(one, "limit", j.limit);
    put_member(one, "unit", j.unit);
    joints.emplace_back(std::move(one));
  }
  put_member(m, "joints", std::move(joints));
  put_member(m, "bodies", w.bodies);
  for (const FaultPoint& p : w.points) {
    Map one;
    put_member(one, "label", p.label);
    one.append("position", Value(NumericArray({p.x, p.y, p.z}, "m")));
    points.emplace_back(std::move(one));
  }
  put_member(m, "points", std::move(points));
  put_member(m, "value", w.value);
  put_member(m, "limit", w.limit);
  put_member(m, "excess", w.excess);
  put_member(m, "unit", w.unit);
  return m;
}

Map map_of(const FaultRemedy& r) {
  Map m;
  put_member(m, "label", r.label);
  put_member(m, "command", r.command);
  m.append("args", Value(r.args));
  m.append("repeats", Value(r.repeats));
  put_member(m, "without", r.without);
  m.append("is_tried", Value(r.is_tried));
  put_member(m, "untried", r.untried);
  return m;
}

Map map_of(const Fault& f, int depth) {
  Map m{{"code", f.code},
        {"class", to_string(f.error)},
        {"severity", to_string(f.severity)},
        {"message", f.message},
        {"where", f.where},
        {"hint", f.hint},
        {"text", sentence(f)}};
  put_member(m, "subject", map_of(f.subject));
  put_member(m, "extent", map_of(f.extent));
  put_member(m, "witness", map_of(f.witness));
  if (f.cause && depth < kMostCauses) m.append("cause", Value(map_of(*f.cause, depth + 1)));
  List remedies;
  for (const FaultRemedy& r : f.remedies) remedies.emplace_back(map_of(r));
  put_member(m, "remedies", std::move(remedies));
  return m;
}

/// Reads members of a map that a peer may have written.
class MapReader {
 public:
  explicit MapReader(const Map* m) : m_(m) {}
  explicit MapReader(const Value* v) : m_(v ? v->as_map() : nullptr) {}
  [[nodiscard]] const Value* find(const char* key) const { return m_ ? m_->find(key) : nullptr; }
  void read(const char* key, std::string& out) const {
    if (const Value* v = find(key); v && v->as_string()) out = text::shortened(*v->as_string());
  }
  template <class Whole>
  requires std::is_unsigned_v<Whole>
  void read(const char* key, Whole& out) const {
    const Value* v = find(key);
    // Programs without integers send 3 as 3.0.
    if (v && v->is_number() && v->number() >= 0 && v->number() <= kMostWhole)
      out = static_cast<Whole>(v->number());
  }
  void read(const char* key, std::optional<double>& out) const {
    if (const Value* v = find(key); v && v->is_number()) out = v->number();
  }
  void read(const char* key, bool& out) const {
    if (const Value* v = find(key); v && v->as_bool()) out = *v->as_bool();
  }
  void read(const char* key, Handle& out) const {
    const Value* v = find(key);
    if (v && v->as_handle()) {
      out = *v->as_handle();
      return;
    }
    // A client keeps handles of another program as {"$handle": {...}}.
    const MapReader inner(MapReader(v).find("$handle"));
    inner.read("kind", out.kind);
    inner.read("number", out.number);
    if (out.kind.empty()) out = {};
  }
  void read(const char* key, std::vector<std::string>& out) const {
    each(key, [&](const Value& v) {
      if (v.as_string()) out.push_back(text::shortened(*v.as_string()));
    });
  }
  void read(const char* key, std::vector<double>& out) const {
    if (const Value* v = find(key); v && v->as_array() && v->as_array()->size() <= kMostRead)
      out.assign(v->as_array()->data().begin(), v->as_array()->data().end());
    each(key, [&](const Value& v) {
      if (v.is_number()) out.push_back(v.number());
    });
  }
  void each(const char* key, const std::function<void(const Value&)>& see) const {
    const Value* v = find(key);
    if (!v || !v->as_list()) return;
    const List& list = *v->as_list();
    std::for_each_n(list.begin(), std::min(list.size(), kMostRead), see);
  }

 private:
  static constexpr double kMostWhole = 4e9;
  const Map* m_;
};

FaultSubject subject_from(const MapReader& m) {
  FaultSubject s;
  m.read("record", s.record);
  m.read("name", s.name);
  m.read("path", s.path);
  m.read("command", s.command);
  m.read("argument", s.argument);
  m.read("provider", s.provider);
  m.read("interface", s.interface_id);
  m.read("file", s.file);
  m.read("line", s.line);
  m.read("column", s.column);
  m.read("end_line", s.end_line);
  m.read("end_column", s.end_column);
  return s;
}

FaultExtent extent_from(const MapReader& m) {
  FaultExtent e;
  m.read("first", e.first);
  m.read("last", e.last);
  m.read("worst", e.worst);
  m.read("from", e.from);
  m.read("to", e.to);
  m.read("at", e.at);
  m.read("segment", e.segment);
  m.read("step", e.step);
  m.read("motion", e.motion);
  return e;
}

FaultWitness witness_from(const MapReader& m) {
  FaultWitness w;
  m.read("scene", w.scene);
  m.read("robot", w.robot);
  m.read("q", w.q);
  m.each("joints", [&](const Value& v) {
    const MapReader one(&v);
    FaultJoint j;
    one.read("name", j.name);
    one.read("number", j.number);
    one.read("value", j.value);
    one.read("limit", j.limit);
    one.read("unit", j.unit);
    w.joints.push_back(std::move(j));
  });
  m.read("bodies", w.bodies);
  m.each("points", [&](const Value& v) {
    const MapReader one(&v);
    FaultPoint p;
    std::vector<double> at;
    one.read("label", p.label);
    one.read("position", at);
    if (at.size() != 3) return;
    p.x = at[0], p.y = at[1], p.z = at[2];
    w.points.push_back(std::move(p));
  });
  m.read("value", w.value);
  m.read("limit", w.limit);
  m.read("excess", w.excess);
  m.read("unit", w.unit);
  return w;
}

FaultRemedy remedy_from(const MapReader& m) {
  FaultRemedy r;
  m.read("label", r.label);
  m.read("command", r.command);
  if (const Value* args = m.find("args"); args && args->as_map()) r.args = *args->as_map();
  m.read("repeats", r.repeats);
  m.read("without", r.without);
  m.read("is_tried", r.is_tried);
  m.read("untried", r.untried);
  return r;
}

std::optional<Fault> read_fault(const Value* v, int depth) {
  const Map* map = v ? v->as_map() : nullptr;
  if (!map) return std::nullopt;
  const MapReader m(map);
  Fault f;
  m.read("code", f.code);
  m.read("message", f.message);
  if (f.code.empty() || f.message.empty()) return std::nullopt;
  std::string word;
  m.read("class", word);
  f.error = error_code_from(word).value_or(f.error);
  word.clear();
  m.read("severity", word);
  f.severity = severity_from(word).value_or(f.severity);
  m.read("where", f.where);
  m.read("hint", f.hint);
  f.subject = subject_from(MapReader(m.find("subject")));
  f.extent = extent_from(MapReader(m.find("extent")));
  f.witness = witness_from(MapReader(m.find("witness")));
  if (depth < kMostCauses)
    if (auto cause = read_fault(m.find("cause"), depth + 1))
      f.cause = std::make_shared<const Fault>(std::move(*cause));
  m.each("remedies", [&](const Value& r) { f.remedies.push_back(remedy_from(MapReader(&r))); });
  return f;
}

using TextEdit = std::function<std::string(std::string)>;

void edit_fault(Fault& f, const TextEdit& edit, int depth) {
  for (std::string* text : {&f.message, &f.where, &f.hint, &f.subject.file})
    *text = edit(std::move(*text));
  for (FaultRemedy& r : f.remedies) {
    r.label = edit(std::move(r.label));
    Map edited;
    for (const auto& [name, value] : r.args)
      edited.append(name, value.as_string() ? Value(edit(*value.as_string())) : value);
    r.args = std::move(edited);
  }
  if (!f.cause) return;
  if (depth >= kMostCauses) {
    f.cause.reset();
    return;
  }
  auto cause = std::make_shared<Fault>(*f.cause);
  edit_fault(*cause, edit, depth + 1);
  f.cause = std::move(cause);
}

}  // namespace

bool operator==(const Fault& a, const Fault& b) { return equal_faults(a, b, 0); }

std::string sentence(const Fault& f) { return sentence_of(f.where, f.message, f.hint); }

std::optional<ErrorCode> error_code_from(std::string_view word) {
  for (auto c = static_cast<std::int32_t>(ErrorCode::invalid_argument);
       c <= static_cast<std::int32_t>(ErrorCode::script_failed); ++c)
    if (to_string(static_cast<ErrorCode>(c)) == word) return static_cast<ErrorCode>(c);
  return std::nullopt;
}

std::optional<Severity> severity_from(std::string_view word) {
  for (const Severity s : {Severity::debug, Severity::info, Severity::warning, Severity::error})
    if (to_string(s) == word) return s;
  return std::nullopt;
}

void set_bound(FaultWitness& w, double value, double limit, std::string_view unit) {
  w.value = value;
  if (std::isfinite(limit)) {
    w.limit = limit;
    w.excess = std::abs(value - limit);
  }
  w.unit = unit;
}

std::shared_ptr<const std::vector<Fault>> kept_faults(const Error& e) {
  return FaultSets::all().find(e);
}

std::vector<Fault> faults_of(const Error& e) {
  const auto kept = kept_faults(e);
  if (!kept || kept->empty()) return {from_text(e)};
  std::vector<Fault> out = *kept;
  if (out.size() == 1) {
    // Whatever was done to the text of the error meanwhile is meant for its only fault.
    Fault& f = out.front();
    f.error = e.code;
    f.message = e.message;
    f.where = e.where;
    f.hint = e.hint;
    return out;
  }
  const std::string outer = outer_place(e, FaultSets::all().where_of(e));
  for (Fault& f : out) f.where = joined_places(outer, f.where);
  return out;
}

Error error_of(Fault f) {
  std::vector<Fault> one;
  one.push_back(std::move(f));
  return error_of(std::move(one));
}

Error error_of(std::vector<Fault> faults) {
  RMP_CHECK(!faults.empty(), "an error of no faults");
  Error all;
  all.code = faults.front().error;
  if (faults.size() == 1) {
    all.message = faults.front().message;
    all.where = faults.front().where;
    all.hint = faults.front().hint;
  } else {
    for (std::size_t i = 0; i < faults.size(); ++i) {
      const Fault& f = faults[i];
      if (f.error != all.code) all.code = ErrorCode::invalid_argument;
      const bool is_repeated = i + 1 < faults.size() && f.hint == faults[i + 1].hint;
      all.message += (all.message.empty() ? "" : " ") +
                     sentence_of(f.where, f.message, is_repeated ? std::string() : f.hint);
    }
  }
  FaultSets::all().keep(all, std::move(faults), {});
  return all;
}

void amend(Error& e, const std::function<void(Fault&)>& amend) {
  const auto kept = kept_faults(e);
  std::vector<Fault> faults = kept && !kept->empty() ? *kept : std::vector<Fault>{from_text(e)};
  for (Fault& f : faults) amend(f);
  FaultSets::all().keep(e, std::move(faults), FaultSets::all().where_of(e));
}

void edit_texts(Error& e, const TextEdit& edit) {
  const auto kept = kept_faults(e);
  std::string where = edit(FaultSets::all().where_of(e));
  for (std::string* text : {&e.message, &e.where, &e.hint}) *text = edit(std::move(*text));
  if (!kept) return;
  std::vector<Fault> faults = *kept;
  for (Fault& f : faults) edit_fault(f, edit, 0);
  FaultSets::all().keep(e, std::move(faults), std::move(where));
}

Map fault_map(const Fault& f) { return map_of(f, 0); }

List fault_list(const Error& e, std::size_t most) {
  List out;
  for (const Fault& f : faults_of(e)) {
    if (out.size() >= most) break;
    out.emplace_back(fault_map(f));
  }
  return out;
}

std::optional<Fault> fault_from(const Value& v) { return read_fault(&v, 0); }

void adopt_faults(Error& e, const Value& v) {
  std::vector<Fault> out;
  if (const List* list = v.as_list())
    for (const Value& each : *list) {
      if (out.size() >= kMostRead) break;
      if (auto f = fault_from(each)) out.push_back(std::move(*f));
    }
  // They were written with the context that the error has now.
  if (!out.empty()) FaultSets::all().keep(e, std::move(out), e.where);
}

FaultCodes::FaultCodes(std::initializer_list<FaultCode> rows) {
  CodeTable& all = code_table();
  const std::lock_guard lock(all.mutex);
  for (const FaultCode& row : rows) RMP_CHECK(all.rows.emplace(row.code, row).second, row.code);
}

const FaultCode* find_fault_code(std::string_view code) {
  CodeTable& all = code_table();
  const std::lock_guard lock(all.mutex);
  const auto it = all.rows.find(code);
  return it == all.rows.end() ? nullptr : &it->second;
}

std::vector<FaultCode> fault_codes() {
  CodeTable& all = code_table();
  const std::lock_guard lock(all.mutex);
  std::vector<FaultCode> out;
  out.reserve(all.rows.size());
  for (const auto& [code, row] : all.rows) out.push_back(row);
  return out;
}

Fault make_fault(std::string_view code, std::string message, std::string hint, std::string where) {
  const FaultCode* row = find_fault_code(code);
  RMP_CHECK(row, "a fault with a code that is not registered");
  Fault f;
  f.code = row->code;
  f.error = row->error;
  f.message = std::move(message);
  f.hint = std::move(hint);
  f.where = std::move(where);
  return f;
}

}  // namespace robomosp
