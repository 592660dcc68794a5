// SPDX-License-Identifier: Apache-2.0
#include "payload.h"

#include <cmath>
#include <cstdint>

namespace robomosp::bridges {
namespace {

constexpr std::size_t kMostOfField = 1000;

/// A number for all, or one for each.
std::vector<double> numbers(Table& t, const char* key, std::size_t count, double when_left_out) {
  const Json* v = t.any(key);
  if (!v) return std::vector<double>(count, when_left_out);
  if (v->is_number() && std::isfinite(v->get<double>()))
    return std::vector<double>(count, v->get<double>());
  if (!v->is_array() || v->size() != count)
    t.fault("is neither a number nor a list of " + std::to_string(count) + ".", key);
  std::vector<double> out;
  for (const Json& each : *v) {
    if (!each.is_number() || !std::isfinite(each.get<double>()))
      t.fault("holds what is not a number.", key);
    out.push_back(each.get<double>());
  }
  return out;
}

/// `value` is handed out only when it is a finite number.
double finite(const Json& value, const std::string& name) {
  if (!value.is_number())
    throw PayloadFault("\"" + name + "\" contains a value that is not a number");
  const double v = value.get<double>();
  if (!std::isfinite(v))
    throw PayloadFault("\"" + name + "\" contains a number that is not finite");
  return v;
}

}  // namespace

FieldMap read_field(Table& t, const std::string& field_when_left_out) {
  FieldMap out;
  out.name = field_when_left_out.empty() ? t.text("field") : t.text("field", field_when_left_out);
  try {
    out.field = Json::json_pointer(out.name);
  } catch (const Json::exception&) {
    t.fault("is not a JSON pointer, such as \"/joints/position\" or \"/q/0\".", "field");
  }
  if (t.has("count"))
    out.count =
        static_cast<std::size_t>(t.number("count", 1, 1, static_cast<double>(kMostOfField)));
  const std::size_t count = out.count.value_or(1);
  out.scale = numbers(t, "scale", count, 1);
  const std::vector<double> sign = numbers(t, "sign", count, 1);
  for (std::size_t i = 0; i < count; ++i) {
    if (sign[i] != 1 && sign[i] != -1) t.fault("is neither 1 nor -1.", "sign");
    out.scale[i] *= sign[i];
  }
  out.offset = numbers(t, "offset", count, 0);
  return out;
}

std::vector<double> read_payload(std::string_view payload,
                                 const std::vector<const FieldMap*>& fields) {
  if (payload.size() > kLongestPayload)
    throw PayloadFault("it has " + std::to_string(payload.size()) + " bytes, more than " +
                       std::to_string(kLongestPayload));
  const Json message = Json::parse(payload, nullptr, false);
  if (message.is_discarded()) throw PayloadFault("it is not JSON");
  std::vector<double> out;
  for (const FieldMap* f : fields) {
    const Json* at = nullptr;
    try {
      if (message.contains(f->field)) at = &message.at(f->field);
    } catch (const Json::exception&) {  // such as a name where a list stands
      at = nullptr;
    }
    if (!at) throw PayloadFault("it has no field \"" + f->name + "\"");
    if (!f->count) {
      out.push_back(f->scale[0] * finite(*at, f->name) + f->offset[0]);
      continue;
    }
    if (!at->is_array())
      throw PayloadFault("\"" + f->name + "\" is not a list of " + std::to_string(*f->count));
    if (at->size() != *f->count)
      throw PayloadFault("\"" + f->name + "\" has " + std::to_string(at->size()) +
                         " entries, not " + std::to_string(*f->count));
    for (std::size_t i = 0; i < *f->count; ++i)
      out.push_back(f->scale[i] * finite((*at)[i], f->name) + f->offset[i]);
  }
  return out;
}

}  // namespace robomosp::bridges
