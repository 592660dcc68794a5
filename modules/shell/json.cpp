// SPDX-License-Identifier: Apache-2.0
#include "shell/json.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "kernel/text.h"

namespace robomosp::shell {
namespace {

using Json = nlohmann::ordered_json;

Json number(double v) {
  if (std::isnan(v)) return "nan";
  if (std::isinf(v)) return v > 0 ? "inf" : "-inf";
  return v;
}

Json array_json(const NumericArray& a) {
  Json out = Json::array();
  if (!a.is_matrix()) {
    for (const double v : a.data()) out.push_back(number(v));
    return out;
  }
  for (std::size_t r = 0; r < a.rows(); ++r) {
    Json row = Json::array();
    for (std::size_t c = 0; c < a.cols(); ++c) row.push_back(number(a.at(r, c)));
    out.push_back(std::move(row));
  }
  return out;
}

/// Recursion is bounded: beyond kDeepestJson a value is given as its text.
Json convert(const Value& v, const NameOf& name_of, std::size_t depth) {
  if (depth >= kDeepestJson) return v.text();
  switch (v.type()) {
    case Value::Type::nil: return nullptr;
    case Value::Type::boolean: return *v.as_bool();
    case Value::Type::integer: return *v.as_int();
    case Value::Type::real: return number(*v.as_real());
    case Value::Type::string: return *v.as_string();
    case Value::Type::array: return array_json(*v.as_array());
    case Value::Type::list: {
      Json out = Json::array();
      for (const Value& item : *v.as_list()) out.push_back(convert(item, name_of, depth + 1));
      return out;
    }
    case Value::Type::map: {
      Json out = Json::object();
      for (const auto& [key, item] : *v.as_map()) out[key] = convert(item, name_of, depth + 1);
      return out;
    }
    case Value::Type::handle: {
      const Handle& h = *v.as_handle();
      Json inner = {{"kind", h.kind}, {"number", h.number}};
      if (const std::string name = name_of ? name_of(h) : std::string(); !name.empty())
        inner["name"] = name;
      return {{"$handle", std::move(inner)}};
    }
  }
  return nullptr;
}

/// {"$handle": {"kind": "robot", "number": 17}} as a handle, anything else as it is.
Value handle_or_map(Map map) {
  if (map.size() == 1) {
    if (const Value* inner = map.find("$handle"); inner && inner->as_map()) {
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
    return add(handle_or_map(std::move(map)));
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
      fault = "the key " + text::quote(frame.key) + " is twice in one object";
      return false;
    }
    frame.map.append(std::move(frame.key), std::move(v));
    return true;
  }
  std::vector<Frame> frames_;
};

}  // namespace

std::string to_json(const Value& value, const NameOf& name_of) {
  return convert(value, name_of, 0).dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Value> from_json(std::string_view text) {
  Builder builder;
  const bool ok = nlohmann::json::sax_parse(text.begin(), text.end(), &builder);
  if (ok && builder.done) return std::move(*builder.done);
  return error(ErrorCode::syntax, "the text is not JSON: " + builder.fault,
               "Send one JSON value a line.");
}

Map error_map(const Error& e) {
  return Map{
      {"code", to_string(e.code)}, {"message", e.message}, {"where", e.where}, {"hint", e.hint}};
}

}  // namespace robomosp::shell
