// SPDX-License-Identifier: Apache-2.0
// Values of the table as values of the SDK, and what a module's result has to be.
#include <cmath>

#include "ioci/core/modules.h"
#include "kernel/text.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

constexpr int kDeepest = 64;  // as Lua's values

Error cannot(std::string what) { return error(ErrorCode::plugin_failed, std::move(what)); }

Result<Value> read(const ModuleValue& v, int depth) {
  if (depth > kDeepest) return cannot("a value is nested deeper than 64");
  using Type = ModuleValue::Type;
  switch (v.type()) {
    case Type::none: return Value();
    case Type::boolean: return Value(v.boolean());
    case Type::integer: return Value(v.integer());
    case Type::real: return Value(v.real());
    case Type::text: return Value(v.text());
    case Type::numbers: {
      const std::size_t n = v.numbers().size();
      if (v.columns() == 0 && v.rows() == n) return Value(NumericArray(v.numbers(), v.unit()));
      if (v.columns() == 0 || n % v.columns() != 0 || n / v.columns() != v.rows())
        return cannot("a matrix of " + std::to_string(v.rows()) + " by " +
                      std::to_string(v.columns()) + " has " + std::to_string(n) + " numbers");
      return Value(NumericArray(v.numbers(), v.rows(), v.columns(), v.unit()));
    }
    case Type::list: {
      List out;
      for (std::size_t i = 0; i < v.size(); ++i) {
        RMP_TRY_ASSIGN(Value item, read(v.item(i), depth + 1));
        out.push_back(std::move(item));
      }
      return Value(std::move(out));
    }
    case Type::map: {
      Map out;
      for (std::size_t i = 0; i < v.size(); ++i) {
        RMP_TRY_ASSIGN(Value item, read(v.item(i), depth + 1));
        out.set(v.key(i), std::move(item));
      }
      return Value(std::move(out));
    }
    case Type::reference: return Value(Handle{v.kind(), v.number()});
  }
  return cannot("a value has the type number " +
                std::to_string(static_cast<std::uint32_t>(v.type())) +
                ", which this program does not know");
}

/// Path of the first number that is not finite; nullopt = none.
std::optional<std::string> not_finite(const Value& v, const std::string& path) {
  if (const double* x = v.as_real(); x && !std::isfinite(*x)) return path;
  if (const NumericArray* a = v.as_array())
    for (std::size_t i = 0; i < a->size(); ++i)
      if (!std::isfinite((*a)[i])) return path + "[" + std::to_string(i + 1) + "]";
  if (const List* list = v.as_list())
    for (std::size_t i = 0; i < list->size(); ++i)
      if (auto bad = not_finite((*list)[i], path + "[" + std::to_string(i + 1) + "]")) return bad;
  if (const Map* m = v.as_map())
    for (const auto& [key, item] : *m)
      if (auto bad = not_finite(item, path.empty() ? key : path + "." + key)) return bad;
  return std::nullopt;
}

bool is_of(std::string_view declared, const Value& v) {
  const std::string_view type = plain_type(declared);
  const NumericArray* a = v.as_array();
  if (type == "any") return true;
  if (type == "nil") return v.is_nil();
  if (type == "bool") return v.as_bool() != nullptr;
  if (type == "int") return v.as_int() != nullptr;
  if (type == "real") return v.is_number();
  if (type == "string" || type == "enum" || type == "path") return v.as_string() != nullptr;
  if (type == "real[]") return a && !a->is_matrix();
  if (type == "vec3") return a && !a->is_matrix() && a->size() == 3;
  if (type == "pose") return a && a->rows() == 4 && a->cols() == 4;
  if (type == "matrix") return a && a->is_matrix();
  if (type == "list") return v.as_list() != nullptr;
  if (type == "map") return v.as_map() != nullptr;
  if (type == "handle") return v.as_handle() != nullptr;
  if (type.starts_with("ref:"))
    return v.as_handle() && (type == "ref:any" || type.substr(4) == v.as_handle()->kind);
  return false;
}

std::string another_type(std::string_view what, const Value& v, std::string_view type) {
  return std::string(what) + " is of type " + std::string(v.type_name()) + ", not " +
         std::string(type);
}

std::string field_fault(const std::vector<ParamSpec>& fields, const Map& m) {
  for (const ParamSpec& f : fields) {
    const Value* v = m.find(f.name);
    if (!v || v->is_nil()) {
      if (f.required) return "it lacks the field " + f.name;
      continue;
    }
    if (!is_of(f.type, *v)) return another_type("the field " + f.name, *v, f.type);
  }
  for (const auto& [key, v] : m) {
    bool is_known = fields.empty();
    for (const ParamSpec& f : fields) is_known = is_known || f.name == key;
    if (!is_known) return "it has the field " + key + ", which its table does not name";
  }
  return "";
}

}  // namespace

ModuleValue to_module(const Value& v) {
  switch (v.type()) {
    case Value::Type::nil: return {};
    case Value::Type::boolean: return {*v.as_bool()};
    case Value::Type::integer: return {*v.as_int()};
    case Value::Type::real: return {*v.as_real()};
    case Value::Type::string: return {*v.as_string()};
    case Value::Type::array: {
      const NumericArray& a = *v.as_array();
      if (!a.is_matrix()) return {a.data(), a.unit()};
      return ModuleValue::matrix(a.data(), a.rows(), a.cols(), a.unit());
    }
    case Value::Type::list: {
      ModuleValue out = ModuleValue::list();
      for (const Value& item : *v.as_list()) out.add(to_module(item));
      return out;
    }
    case Value::Type::map: {
      ModuleValue out = ModuleValue::map();
      for (const auto& [key, item] : *v.as_map()) out.set(key, to_module(item));
      return out;
    }
    case Value::Type::handle:
      return ModuleValue::reference(v.as_handle()->kind, v.as_handle()->number);
  }
  return {};
}

Result<Value> from_module(const ModuleValue& value) { return read(value, 0); }

std::string result_fault(const ReturnSpec& spec, const Value& value) {
  if (const auto bad = not_finite(value, ""))
    return (bad->empty() ? "its result" : *bad + " of its result") + " is not a finite number";
  if (!is_of(spec.type, value)) return another_type("its result", value, spec.type);
  if (const Map* m = value.as_map()) return field_fault(spec.fields, *m);
  if (const List* list = value.as_list(); list && !spec.fields.empty())
    for (std::size_t i = 0; i < list->size(); ++i) {
      const std::string where = "item " + std::to_string(i + 1) + " of its result: ";
      const Map* m = (*list)[i].as_map();
      if (!m) return where + another_type("it", (*list)[i], "map");
      if (std::string fault = field_fault(spec.fields, *m); !fault.empty()) return where + fault;
    }
  return "";
}

}  // namespace robomosp::ioci
