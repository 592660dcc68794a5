// SPDX-License-Identifier: Apache-2.0
#include "remote/json.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "kernel/base64.h"
#include "kernel/fault.h"
#include "kernel/text.h"

namespace robomosp::remote {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr const char* kArray = "$array";
/// In the place of what an {"$array": ...} should hold: why it was not read.
constexpr const char* kFault = "$fault";

/// Bytes of a double in the order of messages.
[[maybe_unused]] double little_endian(double x) {
  std::array<char, sizeof x> bytes{};
  std::memcpy(bytes.data(), &x, sizeof x);
  if constexpr (std::endian::native != std::endian::little)
    std::reverse(bytes.begin(), bytes.end());
  std::memcpy(&x, bytes.data(), sizeof x);
  return x;
}

void write_text(std::string& out, const std::string& text) {
  out += OrderedJson(text).dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

void write_number(std::string& out, double v) {
  if (std::isnan(v)) {
    out += R"("nan")";
  } else if (std::isinf(v)) {
    out += v > 0 ? R"("inf")" : R"("-inf")";
  } else {
    char digits[64];
    out.append(digits, nlohmann::detail::to_chars(digits, digits + sizeof digits, v));
  }
}

/// What `one(i)` writes for each i, in brackets.
template <class One>
void write_list(std::string& out, std::size_t count, One&& one) {
  out += '[';
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) out += ',';
    one(i);
  }
  out += ']';
}

void write_array(std::string& out, const NumericArray& a, Arrays arrays) {
  if (arrays == Arrays::base64) {
    out += R"({"$array":{"shape":[)" + std::to_string(a.rows());
    if (a.is_matrix()) out += "," + std::to_string(a.cols());
    out += R"(],"base64":")";
    std::vector<double> swapped;
    Numbers numbers = a.data();
    if constexpr (std::endian::native != std::endian::little) {
      for (const double x : numbers) swapped.push_back(little_endian(x));
      numbers = swapped;
    }
    base64::append(out, {reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()});
    out += R"("}})";
  } else if (a.is_matrix()) {
    write_list(out, a.rows(), [&](std::size_t r) {
      write_list(out, a.cols(), [&](std::size_t c) { write_number(out, a.at(r, c)); });
    });
  } else {
    write_list(out, a.size(), [&](std::size_t i) { write_number(out, a[i]); });
  }
}

/// About how many characters the arrays of a value take, so that long texts do not move.
std::size_t room_of(const Value& v, Arrays arrays) {
  if (const NumericArray* a = v.as_array()) return a->size() * (arrays == Arrays::base64 ? 11 : 8);
  std::size_t out = 16;
  if (const Map* map = v.as_map())
    for (const auto& [key, item] : *map) out += key.size() + room_of(item, arrays);
  return out;
}

struct Writing {
  const NameOf& name_of;
  Arrays arrays;
};

/// Recursion is bounded: beyond kDeepestJson a value is given as its text.
void write(std::string& out, const Value& v, const Writing& how, std::size_t depth) {
  if (depth >= kDeepestJson) return write_text(out, v.text());
  switch (v.type()) {
    case Value::Type::nil: out += "null"; return;
    case Value::Type::boolean: out += *v.as_bool() ? "true" : "false"; return;
    case Value::Type::integer: out += std::to_string(*v.as_int()); return;
    case Value::Type::real: return write_number(out, *v.as_real());
    case Value::Type::string: return write_text(out, *v.as_string());
    case Value::Type::array: return write_array(out, *v.as_array(), how.arrays);
    case Value::Type::list:
      return write_list(out, v.as_list()->size(),
                        [&](std::size_t i) { write(out, (*v.as_list())[i], how, depth + 1); });
    case Value::Type::map: {
      char before = '{';
      for (const auto& [key, item] : *v.as_map()) {
        out += std::exchange(before, ',');
        write_text(out, key);
        out += ':';
        write(out, item, how, depth + 1);
      }
      out += v.as_map()->empty() ? "{}" : "}";
      return;
    }
    case Value::Type::handle: {
      const Handle& h = *v.as_handle();
      OrderedJson inner = {{"kind", h.kind}, {"number", h.number}};
      if (const std::string name = how.name_of ? how.name_of(h) : std::string(); !name.empty())
        inner["name"] = name;
      out += OrderedJson{{"$handle", std::move(inner)}}.dump(-1, ' ', false,
                                                             OrderedJson::error_handler_t::replace);
      return;
    }
  }
}

/// {"shape": [rows, cols], "base64": text} as an array, or what is wrong with it.
Result<Value> read_array(const Value& inner, std::string_view text) {
  const auto wrong = [](std::string what) {
    return error(
        ErrorCode::invalid_argument, std::move(what),
        R"(Send {"$array": {"shape": [rows, columns], "base64": "..."}} of little-endian doubles.)");
  };
  const Map* map = inner.as_map();
  const Value* shape = map ? map->find("shape") : nullptr;
  const Value* bytes = map ? map->find("base64") : nullptr;
  if (!shape || !shape->as_list() || !bytes || !bytes->as_string() || map->size() != 2)
    return wrong("an array needs its shape and its base64, and nothing else");
  const List& sizes = *shape->as_list();
  constexpr std::int64_t kMost = std::int64_t{1} << 28;
  for (const Value& n : sizes)
    if (!n.as_int() || *n.as_int() < 0 || *n.as_int() > kMost)
      return wrong("the shape of an array must be one or two whole numbers");
  if (sizes.empty() || sizes.size() > 2 || (sizes.size() == 2 && *sizes[1].as_int() == 0))
    return wrong("the shape of an array must be one or two whole numbers, the second above 0");
  const auto rows = static_cast<std::size_t>(*sizes[0].as_int());
  const std::size_t cols = sizes.size() == 2 ? static_cast<std::size_t>(*sizes[1].as_int()) : 0;
  const std::size_t count = cols ? rows * cols : rows;
  const auto size = base64::decoded_size(text);
  if (!size || *size != count * sizeof(double))
    return wrong("its shape has " + std::to_string(count) + " numbers, " +
                 std::to_string(count * sizeof(double)) + " bytes, and its base64 " +
                 (size ? "has " + std::to_string(*size) : "is cut off"));
  auto room = std::make_shared_for_overwrite<double[]>(count);
  double* numbers = room.get();
  if (!base64::decode(text, reinterpret_cast<char*>(numbers)))
    return wrong("its text is not base64");
  if constexpr (std::endian::native != std::endian::little)
    for (std::size_t i = 0; i < count; ++i) numbers[i] = little_endian(numbers[i]);
  return Value(
      NumericArray(std::shared_ptr<const double>(std::move(room), numbers), rows, cols, {}));
}

/// Long texts under the key "base64" are taken out of a message before it is parsed, since the
/// parser looks at them character by character. In their places stand short ones.
class Lifted {
 public:
  explicit Lifted(std::string_view message) {
    if (message.size() < kLong) return;
    std::size_t copied = 0;
    bool is_base64 = false;  // the text before was this key
    for (std::size_t at = 0; (at = message.find('"', at)) != message.npos;) {
      const std::size_t begin = at + 1;
      std::size_t end = begin;
      for (;; ++end) {
        end = message.find('"', end);
        if (end == message.npos) break;
        std::size_t slashes = 0;
        while (end - slashes > begin && message[end - slashes - 1] == '\\') ++slashes;
        if (slashes % 2 == 0) break;
      }
      if (end == message.npos) break;
      const std::string_view text = message.substr(begin, end - begin);
      if (is_base64 && text.size() >= kLong && text.find('\\') == text.npos) {
        rest_ += message.substr(copied, begin - copied);
        rest_ += kMark + std::to_string(texts_.size());
        copied = end;
        texts_.push_back(text);
      }
      at = end + 1;
      const std::size_t next = message.find_first_not_of(" \t\r\n", at);
      is_base64 = text == "base64" && next != message.npos && message[next] == ':';
    }
    if (!texts_.empty()) rest_ += message.substr(copied);
  }
  [[nodiscard]] bool any() const { return !texts_.empty(); }
  [[nodiscard]] std::string_view rest() const { return rest_; }
  /// The text that `stands` is in the place of, or itself.
  [[nodiscard]] std::string_view text(std::string_view stands) const {
    if (!any() || !stands.starts_with('\0')) return stands;
    const auto i = text::read_int(stands.substr(1));
    return i && *i >= 0 && static_cast<std::size_t>(*i) < texts_.size()
               ? texts_[static_cast<std::size_t>(*i)]
               : stands;
  }

 private:
  static constexpr std::size_t kLong = 1024;
  static constexpr const char* kMark = "\\u0000";
  std::string rest_;
  std::vector<std::string_view> texts_;
};

/// {"$handle": {"kind": "robot", "number": 17}} as a handle, {"$array": ...} as an array, anything
/// else as it is.
Value read_object(Map map, const Lifted& lifted, Handles handles) {
  if (map.size() == 1) {
    if (const Value* inner = map.find(kArray)) {
      const Value* bytes = inner->as_map() ? inner->as_map()->find("base64") : nullptr;
      auto array = read_array(
          *inner, lifted.text(bytes && bytes->as_string() ? *bytes->as_string() : std::string()));
      if (array.ok()) return std::move(*array);
      return Map{{kArray, Map{{kFault, array.error().message}, {"hint", array.error().hint}}}};
    }
    const Value* inner = handles == Handles::own ? map.find("$handle") : nullptr;
    if (inner && inner->as_map()) {
      const Value* kind = inner->as_map()->find("kind");
      const Value* n = inner->as_map()->find("number");
      if (kind && kind->as_string() && n && n->as_int() && *n->as_int() > 0)
        return Handle{*kind->as_string(), static_cast<std::uint64_t>(*n->as_int())};
    }
  }
  return map;
}

/// Builds a Value while the text is read, so that depth is refused before anything deep exists.
class Builder final : public nlohmann::json_sax<nlohmann::json> {
 public:
  Builder(const Lifted& lifted, Handles handles) : lifted_(lifted), handles_(handles) {}
  bool null() override { return add(Value()); }
  bool boolean(bool v) override { return add(v); }
  bool number_integer(number_integer_t v) override {
    return add(Value(static_cast<std::int64_t>(v)));
  }
  bool number_unsigned(number_unsigned_t v) override {
    if (v > static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max()))
      return add(Value(static_cast<double>(v)));
    return add(Value(static_cast<std::int64_t>(v)));
  }
  bool number_float(number_float_t v, const string_t&) override { return add(v); }
  bool string(string_t& v) override { return add(std::move(v)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(true); }
  bool start_array(std::size_t) override { return open(false); }
  bool key(string_t& v) override {
    frames_.back().key = std::move(v);
    return true;
  }
  bool end_object() override {
    Map map = std::move(frames_.back().map);
    frames_.pop_back();
    // A text that was taken out belongs to an array, or is read where it was.
    const bool is_inner = !frames_.empty() && frames_.back().key == kArray;
    if (!is_inner && stands_for_another(map.find("base64"))) return false;
    if (const Value* inner = map.size() > 1 ? map.find(kArray) : nullptr; inner && inner->as_map())
      if (stands_for_another(inner->as_map()->find("base64"))) return false;
    return add(read_object(std::move(map), lifted_, handles_));
  }
  bool end_array() override {
    List list = std::move(frames_.back().list);
    frames_.pop_back();
    return add(std::move(list));
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& e) override {
    // "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error while ..."
    std::string_view what = e.what();
    if (what.starts_with("[json.")) what.remove_prefix(std::min(what.find(']') + 1, what.size()));
    if (const auto at = what.find(": "); what.starts_with(" parse error") && at != what.npos)
      what.remove_prefix(at + 1);
    fault = "byte " + std::to_string(position) + ":" + std::string(what);
    return false;
  }

  std::optional<Value> done;
  std::string fault;

 private:
  struct Frame {
    bool is_object = false;
    Map map;
    List list;
    std::string key;
    std::unordered_set<std::string> keys;
  };
  [[nodiscard]] bool stands_for_another(const Value* text) const {
    return text && text->as_string() &&
           lifted_.text(*text->as_string()).data() != text->as_string()->data();
  }
  bool open(bool is_object) {
    if (frames_.size() >= kDeepestJson) {
      fault = "it is nested deeper than " + std::to_string(kDeepestJson) + " levels";
      return false;
    }
    frames_.emplace_back().is_object = is_object;
    return true;
  }
  bool add(Value v) {
    if (frames_.empty()) done = std::move(v);
    else if (frames_.back().is_object) return add_named(frames_.back(), std::move(v));
    else frames_.back().list.push_back(std::move(v));
    return true;
  }
  /// Of keys that are there twice the last one counts. Maps look for keys one by one, so those of
  /// large ones are kept here as well, and must be there once.
  bool add_named(Frame& frame, Value v) {
    constexpr std::size_t kFew = 32;
    if (frame.map.size() < kFew) {
      frame.map.set(std::move(frame.key), std::move(v));
      return true;
    }
    if (frame.keys.empty())
      for (const auto& entry : frame.map) frame.keys.insert(entry.first);
    if (!frame.keys.insert(frame.key).second) {
      fault = "the key " + text::quote(frame.key) + " appears twice in one object";
      return false;
    }
    frame.map.append(std::move(frame.key), std::move(v));
    return true;
  }
  const Lifted& lifted_;
  const Handles handles_;
  std::vector<Frame> frames_;
};

}  // namespace

std::string to_json(const Value& value, const NameOf& name_of, Arrays arrays) {
  std::string out;
  append_json(out, value, name_of, arrays);
  return out;
}

void append_json(std::string& out, const Value& value, const NameOf& name_of, Arrays arrays) {
  constexpr std::size_t kAround = 256;  // of a message around it
  out.reserve(out.size() + room_of(value, arrays) + kAround);
  write(out, value, {name_of, arrays}, 0);
}

Result<Value> from_json(std::string_view text, Handles handles) {
  if (const Lifted lifted(text); lifted.any()) {
    Builder builder(lifted, handles);
    const std::string_view rest = lifted.rest();
    if (nlohmann::json::sax_parse(rest.begin(), rest.end(), &builder) && builder.done)
      return std::move(*builder.done);
    // What is wrong is told of the message as it is.
  }
  const Lifted none{std::string_view()};
  Builder builder(none, handles);
  const bool ok = nlohmann::json::sax_parse(text.begin(), text.end(), &builder);
  if (ok && builder.done) return std::move(*builder.done);
  return error(ErrorCode::syntax, "the text is not JSON: " + builder.fault,
               "Send one JSON value per line.");
}

std::optional<Error> array_fault(const Value& value) {
  if (const Map* map = value.as_map()) {
    const Value* inner = map->size() == 1 ? map->find(kArray) : nullptr;
    if (inner && inner->as_map())
      if (const Value* fault = inner->as_map()->find(kFault); fault && fault->as_string()) {
        const Value* hint = inner->as_map()->find("hint");
        return error(ErrorCode::invalid_argument, *fault->as_string(),
                     hint && hint->as_string() ? *hint->as_string() : std::string());
      }
    for (const auto& [key, item] : *map)
      if (auto fault = array_fault(item)) return std::move(*fault).in(key);
  } else if (const List* list = value.as_list()) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      const Value& item = (*list)[i];
      if (item.is_number()) continue;
      if (auto fault = array_fault(item))
        return std::move(*fault).in("[" + std::to_string(i + 1) + "]");
    }
  }
  return std::nullopt;
}

Map error_map(const Error& e) {
  Map out{
      {"code", to_string(e.code)}, {"message", e.message}, {"where", e.where}, {"hint", e.hint}};
  if (kept_faults(e)) out.set("faults", fault_list(e));
  return out;
}

}  // namespace robomosp::remote
