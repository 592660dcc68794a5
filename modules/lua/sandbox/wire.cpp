// SPDX-License-Identifier: Apache-2.0
#include "lua/sandbox/wire.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "kernel/fault.h"

namespace robomosp::lua::wire {
namespace {

constexpr std::size_t kLongestText = std::size_t{64} << 10;  ///< of an error

enum class Tag : std::uint8_t {
  nil,
  no,
  yes,
  integer,
  real,
  text,
  vector,
  matrix,
  list,
  map,
  handle
};

template <class T>
void put(std::string& out, T v) {
  out.append(reinterpret_cast<const char*>(&v), sizeof v);
}
void put_size(std::string& out, std::size_t n) {
  put(out, static_cast<std::uint32_t>(
               std::min<std::size_t>(n, std::numeric_limits<std::uint32_t>::max())));
}
void put_text(std::string& out, std::string_view s) {
  put_size(out, s.size());
  out += s;
}

class Writer {
 public:
  Writer(std::string& out, std::size_t longest) : out_(out), longest_(longest) {}

  // The depth of the recursion is that of the value, which kDeepest bounds.
  bool write(const Value& v, int depth = 0) {
    if (depth > kDeepest || ++count_ > kMostValues || out_.size() > longest_) return false;
    const auto tag = [this](Tag t) { out_ += static_cast<char>(t); };
    switch (v.type()) {
      case Value::Type::nil: tag(Tag::nil); break;
      case Value::Type::boolean: tag(*v.as_bool() ? Tag::yes : Tag::no); break;
      case Value::Type::integer:
        tag(Tag::integer);
        put(out_, *v.as_int());
        break;
      case Value::Type::real:
        tag(Tag::real);
        put(out_, *v.as_real());
        break;
      case Value::Type::string:
        if (!fits(v.as_string()->size())) return false;
        tag(Tag::text);
        put_text(out_, *v.as_string());
        break;
      case Value::Type::array: {
        const NumericArray& a = *v.as_array();
        if (!fits(a.size() * sizeof(double))) return false;
        tag(a.is_matrix() ? Tag::matrix : Tag::vector);
        put_size(out_, a.rows());
        if (a.is_matrix()) put_size(out_, a.cols());
        put_text(out_, a.unit());
        if (a.size() > 0)
          out_.append(reinterpret_cast<const char*>(a.data().data()), a.size() * sizeof(double));
        break;
      }
      case Value::Type::list:
        tag(Tag::list);
        put_size(out_, v.as_list()->size());
        for (const Value& item : *v.as_list())
          if (!write(item, depth + 1)) return false;
        break;
      case Value::Type::map:
        tag(Tag::map);
        put_size(out_, v.as_map()->size());
        for (const auto& [key, item] : *v.as_map()) {
          if (!fits(key.size())) return false;
          put_text(out_, key);
          if (!write(item, depth + 1)) return false;
        }
        break;
      case Value::Type::handle:
        tag(Tag::handle);
        put_text(out_, v.as_handle()->kind);
        put(out_, v.as_handle()->number);
        break;
    }
    return out_.size() <= longest_;
  }

 private:
  [[nodiscard]] bool fits(std::size_t more) const {
    return more <= longest_ && out_.size() + more <= longest_;
  }
  std::string& out_;
  std::size_t longest_;
  std::size_t count_ = 0;
};

class Reader {
 public:
  explicit Reader(std::string_view in) : in_(in) {}

  // The depth of the recursion is bounded by kDeepest.
  bool read(Value& out, int depth = 0) {
    std::uint8_t tag = 0;
    if (depth > kDeepest || !plain(tag)) return false;
    switch (static_cast<Tag>(tag)) {
      case Tag::nil: out = Value(); return true;
      case Tag::no: out = Value(false); return true;
      case Tag::yes: out = Value(true); return true;
      case Tag::integer: {
        std::int64_t v = 0;
        if (!plain(v)) return false;
        out = Value(v);
        return true;
      }
      case Tag::real: {
        double v = 0;
        if (!plain(v)) return false;
        out = Value(v);
        return true;
      }
      case Tag::text: {
        std::string_view s;
        if (!text(s)) return false;
        out = Value(s);
        return true;
      }
      case Tag::vector:
      case Tag::matrix: return array(out, static_cast<Tag>(tag) == Tag::matrix);
      case Tag::list: return list(out, depth);
      case Tag::map: return map(out, depth);
      case Tag::handle: {
        std::string_view kind;
        std::uint64_t number = 0;
        if (!text(kind) || kind.size() > kLongestKind || !plain(number)) return false;
        out = Value(Handle{std::string(kind), number});
        return true;
      }
    }
    return false;
  }
  [[nodiscard]] bool is_at_end() const { return in_.empty(); }

 private:
  static constexpr std::size_t kLongestKind = 256;

  template <class T>
  bool plain(T& v) {
    if (in_.size() < sizeof v) return false;
    std::memcpy(&v, in_.data(), sizeof v);
    in_.remove_prefix(sizeof v);
    return true;
  }
  bool text(std::string_view& s) {
    std::uint32_t n = 0;
    if (!plain(n) || n > in_.size()) return false;
    s = in_.substr(0, n);
    in_.remove_prefix(n);
    return true;
  }
  bool array(Value& out, bool is_matrix) {
    std::uint32_t rows = 0, cols = 0;
    std::string_view unit;
    if (!plain(rows) || (is_matrix && !plain(cols)) || !text(unit)) return false;
    if (is_matrix && cols == 0) return false;  // it would be a vector
    const std::uint64_t count = is_matrix ? std::uint64_t{rows} * cols : rows;
    if (count > in_.size() / sizeof(double)) return false;
    std::vector<double> numbers(count);
    if (count > 0) std::memcpy(numbers.data(), in_.data(), count * sizeof(double));
    in_.remove_prefix(count * sizeof(double));
    out = is_matrix ? Value(NumericArray(std::move(numbers), rows, cols, std::string(unit)))
                    : Value(NumericArray(std::move(numbers), std::string(unit)));
    return true;
  }
  /// How many items follow, each of at least `least` bytes. They are counted before they are read,
  /// so that lists in lists cannot each ask for the memory of all.
  bool size(std::uint32_t& n, std::size_t least) {
    if (!plain(n) || n > in_.size() / least || n > kMostValues - count_) return false;
    count_ += n;
    return true;
  }
  bool list(Value& out, int depth) {
    std::uint32_t n = 0;
    if (!size(n, 1)) return false;
    List items(n);
    for (Value& item : items)
      if (!read(item, depth + 1)) return false;
    out = Value(std::move(items));
    return true;
  }
  bool map(Value& out, int depth) {
    std::uint32_t n = 0;
    if (!size(n, 5)) return false;
    Map items;
    std::vector<std::string_view> keys;
    keys.reserve(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      std::string_view key;
      Value item;
      if (!text(key) || !read(item, depth + 1)) return false;
      keys.push_back(key);
      items.append(std::string(key), std::move(item));
    }
    std::sort(keys.begin(), keys.end());
    if (std::adjacent_find(keys.begin(), keys.end()) != keys.end()) return false;
    out = Value(std::move(items));
    return true;
  }

  std::string_view in_;
  std::size_t count_ = 1;
};

std::string cut(std::string_view s) { return std::string(s.substr(0, kLongestText)); }

std::string text_of(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  return v && v->as_string() ? cut(*v->as_string()) : std::string();
}

}  // namespace

void Inbox::add(std::string_view bytes) {
  bytes_.erase(0, std::exchange(taken_, 0));
  bytes_.append(bytes);
}

std::optional<std::string> frame(Kind kind, const Value& value, std::size_t longest) {
  std::string out(kHeader, '\0');
  out[kHeader - 1] = static_cast<char>(kind);
  if (!Writer(out, longest).write(value)) return std::nullopt;
  const auto length = static_cast<std::uint32_t>(out.size() - kHeader);
  std::memcpy(out.data(), &length, sizeof length);
  return out;
}

std::optional<Value> read_value(std::string_view bytes) {
  Reader reader(bytes);
  Value out;
  if (!reader.read(out) || !reader.is_at_end()) return std::nullopt;
  return out;
}

Result<std::optional<Frame>> Inbox::take() {
  const auto broken = [](const char* why) {
    return error(ErrorCode::plugin_failed,
                 std::string("the received data are not a message: ") + why);
  };
  const std::string_view rest = std::string_view(bytes_).substr(taken_);
  if (rest.size() < kHeader) return std::optional<Frame>();
  std::uint32_t length = 0;
  std::memcpy(&length, rest.data(), sizeof length);
  if (length > longest_) return broken("it is too long");
  const auto kind = static_cast<Kind>(rest[kHeader - 1]);
  switch (kind) {
    case Kind::setup:
    case Kind::eval:
    case Kind::answer:
    case Kind::ready:
    case Kind::request:
    case Kind::print:
    case Kind::done: break;
    default: return broken("it is of unknown kind");
  }
  if (rest.size() - kHeader < length) return std::optional<Frame>();
  auto value = read_value(rest.substr(kHeader, length));
  if (!value) return broken("its value cannot be read");
  taken_ += kHeader + length;
  return std::optional<Frame>(Frame{kind, std::move(*value)});
}

Value error_value(const Error& e) {
  constexpr std::size_t kMostFaults = 20;
  Map out{{"code", to_string(e.code)},
          {"message", cut(e.message)},
          {"where", cut(e.where)},
          {"hint", cut(e.hint)}};
  if (kept_faults(e)) out.set("faults", fault_list(e, kMostFaults));
  return out;
}

Error error_from(const Value& v) {
  const Map* m = v.as_map();
  if (!m) return error(ErrorCode::script_failed, "the script failed without an error message");
  Error e;
  e.code = error_code_from(text_of(*m, "code")).value_or(ErrorCode::script_failed);
  e.message = text_of(*m, "message");
  e.where = text_of(*m, "where");
  e.hint = text_of(*m, "hint");
  if (const Value* faults = m->find("faults")) adopt_faults(e, *faults);
  if (e.message.empty()) e.message = "the script failed without an error message";
  return e;
}

}  // namespace robomosp::lua::wire
