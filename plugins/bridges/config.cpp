// SPDX-License-Identifier: Apache-2.0
#include "config.h"

#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

namespace robomosp::bridges {
namespace {

std::string in(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

}  // namespace

Table::Table(const Json& json, std::string path) : json_(json), path_(std::move(path)) {
  if (!json_.is_object())
    throw ConfigFault((path_.empty() ? "The configuration" : path_) + " is not a table in braces.");
}

void Table::fault(const std::string& what, const char* key) const {
  throw ConfigFault((key             ? in(path_, key)
                     : path_.empty() ? "The configuration"
                                     : path_) +
                    " " + what);
}

const Json* Table::any(const char* key) {
  asked_.insert(key);
  const auto at = json_.find(key);
  return at == json_.end() || at->is_null() ? nullptr : &*at;
}
bool Table::has(const char* key) { return any(key) != nullptr; }

std::string Table::text(const char* key) {
  const Json* v = any(key);
  if (!v) fault("is missing.", key);
  if (!v->is_string() || v->get_ref<const std::string&>().empty()) fault("is not a text.", key);
  return v->get<std::string>();
}
std::string Table::text(const char* key, std::string when_left_out) {
  return has(key) ? text(key) : std::move(when_left_out);
}

double Table::number(const char* key, double when_left_out, double least, double most) {
  const Json* v = any(key);
  if (!v) return when_left_out;
  if (!v->is_number()) fault("is no number.", key);
  const double number = v->get<double>();
  if (!(number >= least && number <= most))
    fault("is " + v->dump() + "; it must be from " + Json(least).dump() + " to " +
              Json(most).dump() + ".",
          key);
  return number;
}

bool Table::flag(const char* key, bool when_left_out) {
  const Json* v = any(key);
  if (!v) return when_left_out;
  if (!v->is_boolean()) fault("is neither true nor false.", key);
  return v->get<bool>();
}

Table Table::table(const char* key) {
  const Json* v = any(key);
  if (!v) fault("is missing.", key);
  return {*v, in(path_, key)};
}

std::vector<Table> Table::tables(const char* key) {
  const Json* v = any(key);
  std::vector<Table> out;
  if (!v) return out;
  if (!v->is_array()) fault("is not a list in brackets.", key);
  for (std::size_t i = 0; i < v->size(); ++i)
    out.emplace_back((*v)[i], in(path_, key) + "[" + std::to_string(i + 1) + "]");
  return out;
}

void Table::done() const {
  for (const auto& [key, value] : json_.items())
    if (!asked_.contains(key)) {
      std::string known;
      for (const std::string& k : asked_) known += (known.empty() ? "" : ", ") + k;
      throw ConfigFault(in(path_, key) + " is unknown. Known are " + known + ".");
    }
}

RecordingWish read_recording(Table& t) {
  RecordingWish out;
  out.title = t.text("title");
  out.robot = t.text("robot", "");
  out.world = t.text("world", "");
  if (!out.world.empty() && out.robot.empty())
    t.fault("is missing, although a world is given.", "robot");
  out.most_rows = static_cast<std::size_t>(t.number("rows", 1e6, 1, 1e8));
  out.keep = static_cast<std::size_t>(t.number("keep", 4, 1, 1e6));
  return out;
}

ServerWish read_server(Table& config) {
  ServerWish out;
  if (!config.has("robomosp")) return out;
  Table t = config.table("robomosp");
  out.address = t.text("address", out.address);
  if (t.has("token_file")) out.token = read_secret(t.text("token_file"), t.path() + ".token_file");
  out.queue = static_cast<std::size_t>(t.number("queue", 20000, 1, 1e7));
  out.batch_seconds = t.number("batch_seconds", 0.1, 0.001, 60);
  out.batch_rows = static_cast<std::size_t>(t.number("batch_rows", 1000, 1, 10000));
  t.done();
  return out;
}

Json read_config(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw ConfigFault("The configuration \"" + file.string() + "\" cannot be read.");
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  try {
    return Json::parse(text, nullptr, true, true);
  } catch (const Json::exception& e) {
    throw ConfigFault("\"" + file.string() + "\" is not JSON: " + e.what());
  }
}

std::string read_secret(const std::string& file, const std::string& where) {
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0)
    throw ConfigFault(where + ": the file \"" + file + "\" cannot be read.");
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw ConfigFault(where + ": others may open \"" + file + "\". Run chmod 600 on it.");
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line) || line.empty())
    throw ConfigFault(where + ": the file \"" + file + "\" contains no secret.");
  return line;
}

}  // namespace robomosp::bridges
