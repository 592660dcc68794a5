// SPDX-License-Identifier: Apache-2.0
// Rules of http://sdformat.org/tutorials (pose frame semantics, composition).
#include "sdf_models.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "files.h"
#include "reach.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robot_files {
namespace {

constexpr const char* kModelFrame = "__model__";
constexpr std::size_t kMostModels = 1000;
constexpr int kDeepestPlacement = 100;

Result<Pose> raw_pose(const Element& e) {
  Pose t;
  const Element* p = e.FirstChildElement("pose");
  if (!p || inner(*p).empty()) return t;
  if (word(*p, "rotation_format") == "quat_xyzw") {
    std::array<double, 7> v{};
    RMP_TRY(read(*p, inner(*p), "pose", v));
    if (!(std::hypot(std::hypot(v[3], v[4]), std::hypot(v[5], v[6])) > 1e-9))
      return fault(*p, "its quaternion has no length", "The neutral one is 0 0 0 1.");
    t.p = {v[0], v[1], v[2]};
    t.R = spatial::from_quaternion({v[6], v[3], v[4], v[5]});
    return t;
  }
  std::array<double, 6> v{};
  RMP_TRY(read(*p, inner(*p), "pose", v));
  const double turn = is_yes(word(*p, "degrees"), false) ? std::numbers::pi / 180 : 1;
  t.p = {v[0], v[1], v[2]};
  t.R = spatial::from_rpy({v[3] * turn, v[4] * turn, v[5] * turn});
  return t;
}

/// Whether a joint stands anywhere inside.
bool has_joint(const Element& model) {
  std::vector<const Element*> stack{&model};
  while (!stack.empty()) {
    const Element* e = stack.back();
    stack.pop_back();
    if (e->FirstChildElement("joint")) return true;
    for (const Element* m = e->FirstChildElement("model"); m; m = m->NextSiblingElement("model"))
      stack.push_back(m);
  }
  return false;
}

}  // namespace

std::string_view text_of(const Element& e, const char* child) {
  const Element* c = e.FirstChildElement(child);
  return c ? inner(*c) : std::string_view();
}
Result<double> real_of(const Element& e, const char* child, double otherwise) {
  const Element* c = e.FirstChildElement(child);
  if (!c || inner(*c).empty()) return otherwise;
  RMP_TRY_ASSIGN(const auto v, numbers(*c, inner(*c), child));
  if (v.size() != 1) return fault(*c, "one number was expected", "Correct the file.");
  return v[0];
}
Result<Vec3> triple_of(const Element& e, const char* child, Vec3 otherwise) {
  const Element* c = e.FirstChildElement(child);
  if (c && !inner(*c).empty()) RMP_TRY(read(*c, inner(*c), child, otherwise));
  return otherwise;
}

std::filesystem::path SdfModels::folder_of(const Element& e) const {
  const Source* s = source_of(e);
  return s && !s->path.empty() ? s->path.parent_path() : folder_;
}

// --- which model ---------------------------------------------------------------------------------

Result<void> SdfModels::read(const Element& root) {
  const Element* at = &root;
  if (const Element* w = root.FirstChildElement("world")) at = w;
  std::vector<Open> found;
  for (const Element* e = at->FirstChildElement(); e; e = e->NextSiblingElement()) {
    const std::string_view kind = e->Name();
    if (found.size() >= kMostModels) return fault(*e, "there are more than 1000 models");
    if (kind == "model") found.push_back({e, nullptr, "", ""});
    if (kind != "include") continue;
    RMP_TRY_ASSIGN(const Element* model, included(*e));
    if (model) found.push_back({model, e, "", ""});
  }
  if (found.empty()) return fault(root, "it contains no <model>", "Give a robot's file.");
  const auto moving =
      std::find_if(found.begin(), found.end(), [](const Open& o) { return has_joint(*o.e); });
  const Open chosen = moving == found.end() ? found[0] : *moving;
  std::string others;
  for (const Open& o : found)
    if (o.e != chosen.e) others += (others.empty() ? "" : ", ") + in_quotes(word(*o.e, "name"));
  if (!others.empty())
    notes_.push_back("Only one of several models was read; left out: " + others + ".");
  const Element& placed = chosen.include ? *chosen.include : *chosen.e;
  if (!text_of(placed, "pose").empty())
    notes_.emplace_back("The model's pose in its world was left out.");
  model_ = chosen.e;
  std::vector<Open> stack{chosen};
  while (!stack.empty()) {
    const Open o = std::move(stack.back());
    stack.pop_back();
    std::vector<Open> inside;
    RMP_TRY(open(o, inside));
    for (std::size_t i = inside.size(); i-- > 0;) stack.push_back(std::move(inside[i]));
  }
  return {};
}

Result<const Element*> SdfModels::included(const Element& include) {
  namespace fs = std::filesystem;
  const std::string uri(text_of(include, "uri"));
  if (uri.empty())
    return fault(include, "it includes no <uri>", "Give the model's file or folder.");
  const fs::path folder = folder_of(include);
  const auto find = [&](const std::string& written) {
    const auto scheme = written.find("://");
    fs::path found;
    if (scheme == std::string::npos || written.starts_with("file://")) {
      found = folder / (scheme == std::string::npos ? written : written.substr(7));
      if (scheme == std::string::npos && !files::exists(found)) {
        found = found_above(written, folder);
        if (files::is_folder(found) && fs::path(written).lexically_normal() == fs::path(written) &&
            written.find("..") == std::string::npos)
          documents_.reach().add(found);
      }
    } else if (written.starts_with("model://") || written.starts_with("package://")) {
      const fs::path named = fs::path(written.substr(scheme + 3)).lexically_normal();
      if (!named.empty() && *named.begin() != "..") {
        found = found_above(named, folder);
        if (!found.empty())
          documents_.reach().add(files::is_folder(found) ? found : found.parent_path());
      }
    }
    return found;
  };
  fs::path found = find(uri);
  if (const std::string plain = without_escapes(uri); !files::exists(found) && plain != uri)
    found = find(plain);
  if (files::is_folder(found)) {
    fs::path file = found / "model.sdf";
    if (files::is_file(found / "model.config")) {
      RMP_TRY_ASSIGN(const Element* config, documents_.open(include, found / "model.config"));
      for (const Element* e = config->FirstChildElement("sdf"); e; e = e->NextSiblingElement("sdf"))
        if (files::is_file(found / std::string(inner(*e)))) file = found / std::string(inner(*e));
    }
    found = file;
  }
  if (!files::is_file(found)) {
    missing_ += (missing_.empty() ? "" : " or ") + uri;
    notes_.push_back("Model " + in_quotes(uri) + " (" + place(include) +
                     ") was not found beside the file or above it, and was left out.");
    return nullptr;
  }
  RMP_TRY_ASSIGN(const Element* root, documents_.open(include, found));
  const Element* model = root->FirstChildElement("model");
  if (!model)
    return fault(include, in_quotes(uri) + " holds no <model>", "Include the file of a model.");
  return model;
}

Result<void> SdfModels::open(const Open& o, std::vector<Open>& inside) {
  if (models_.size() >= kMostModels) return fault(*o.e, "there are more than 1000 models");
  const bool is_outermost = models_.empty();
  models_.push_back(o.e);
  const bool is_merged = o.include && is_yes(word(*o.include, "merge"), false) && !is_outermost;
  const auto said = [&](const char* what) {
    const std::string_view own = o.include ? text_of(*o.include, what) : std::string_view();
    return std::string(own);
  };
  std::string name = said("name");
  if (name.empty()) name = std::string(word(*o.e, "name"));
  if (name.empty() && !is_outermost)
    return fault(*o.e, "a model inside another one has no name", "Give it one.");
  // The model as a frame of the one around it.
  Scoped here;
  here.scope = is_outermost || is_merged ? o.scope : o.scope + name + "::";
  here.model = is_outermost ? kModelFrame
               : is_merged  ? o.scope + "_merged__" + name + kModelFrame
                            : o.scope + name;
  Frame frame;
  if (!is_outermost) {
    const bool has_own_pose = o.include && o.include->FirstChildElement("pose");
    frame.e = has_own_pose ? o.include : o.e;
    Scoped around;
    around.scope = o.scope;
    around.model = o.model;
    const std::string from = relative_to(*frame.e);
    frame.base = from.empty() ? o.model : full_name(around, from);
    std::string placed = said("placement_frame");
    if (placed.empty()) placed = std::string(word(*o.e, "placement_frame"));
    if (!placed.empty()) frame.placed = full_name(here, placed);
  }
  // What a model stands on: its canonical link, the first one where none is named.
  const Element* first = o.e->FirstChildElement("link");
  const std::string canonical(has(*o.e, "canonical_link") ? word(*o.e, "canonical_link")
                              : first                     ? word(*first, "name")
                                                          : std::string_view());
  frame.stands_on = canonical.empty() ? "world" : full_name(here, canonical);
  if (!frames_.emplace(here.model, frame).second)
    return fault(*o.e, in_quotes(here.model) + " stands twice", "Rename one of them.");
  if (!is_outermost && !is_merged) {
    Frame same;
    same.base = same.stands_on = here.model;
    frames_.emplace(here.scope + kModelFrame, same);
  }
  for (const Element* e = o.e->FirstChildElement(); e; e = e->NextSiblingElement()) {
    const std::string_view kind = e->Name();
    if (kind == "model") {
      inside.push_back({e, nullptr, here.scope, here.model});
      continue;
    }
    if (kind == "include") {
      RMP_TRY_ASSIGN(const Element* model, included(*e));
      if (model) inside.push_back({model, e, here.scope, here.model});
      continue;
    }
    if (kind != "link" && kind != "joint" && kind != "frame") continue;
    Scoped s = here;
    s.e = e;
    const std::string own(word(*e, "name"));
    if (own.empty()) return fault(*e, "it has no name", "Give it one.");
    s.name = s.scope + own;
    if (frames_.size() >= 4 * kMostBodies) return fault(*e, "there are too many links and joints");
    Frame f;
    f.e = e;
    std::string otherwise;
    if (kind == "joint") otherwise = f.stands_on = full_name(s, text_of(*e, "child"));
    if (kind == "frame") otherwise = f.stands_on = full_name(s, word(*e, "attached_to"));
    const std::string from = relative_to(*e);
    f.base = !from.empty() ? full_name(s, from) : otherwise.empty() ? s.model : otherwise;
    // Joints may be named like links in old files; the link is the frame then.
    const auto known = frames_.find(s.name);
    if (known == frames_.end()) frames_.emplace(s.name, std::move(f));
    else if (kind == "link") known->second = std::move(f);
    (kind == "link" ? links_ : joints_).push_back(std::move(s));
    if (kind == "frame") joints_.pop_back();
  }
  return {};
}

// --- frames --------------------------------------------------------------------------------------

std::string SdfModels::relative_to(const Element& e) {
  const Element* p = e.FirstChildElement("pose");
  if (!p) return {};
  return std::string(word(*p, has(*p, "relative_to") ? "relative_to" : "frame"));
}

std::string SdfModels::full_name(const Scoped& in, std::string_view name) {
  if (name.empty() || name == kModelFrame) return in.model;
  if (name == "world" || name == "__root__") return "world";
  return in.scope + std::string(name);
}

Result<Pose> SdfModels::local_pose(const Element& asked, const std::string& name,
                                   const std::string& stop, int depth) {
  std::vector<Frame*> chain;
  Pose at;
  for (std::string n = name; !n.empty() && n != "world" && n != stop;) {
    const auto it = frames_.find(n);
    if (it == frames_.end())
      return fault(asked, in_quotes(n) + " is not a frame of the model",
                   "Frames are its links, joints, frames and models.");
    if (it->second.is_done && stop.empty()) {
      at = it->second.pose;
      break;
    }
    if (chain.size() > frames_.size())
      return fault(asked, "the frames of " + in_quotes(name) + " refer to each other in a circle",
                   "Correct relative_to.");
    chain.push_back(&it->second);
    n = it->second.base;
  }
  for (std::size_t i = chain.size(); i-- > 0;) {
    Frame& f = *chain[i];
    if (f.e) {
      RMP_TRY_ASSIGN(const Pose own, raw_pose(*f.e));
      at = spatial::compose(at, own);
    }
    if (!f.placed.empty()) {
      // The pose is that of a frame inside the model.
      if (depth >= kDeepestPlacement)
        return fault(asked, "the placement of " + in_quotes(name) + " refers to itself",
                     "Correct placement_frame.");
      std::string model;
      for (const auto& [key, frame] : frames_)
        if (&frame == &f) model = key;
      RMP_TRY_ASSIGN(const Pose inside, local_pose(asked, f.placed, model, depth + 1));
      at = spatial::compose(at, spatial::inverse(inside));
    }
    if (stop.empty()) {
      f.pose = at;
      f.is_done = true;
    }
  }
  return at;
}

Result<Pose> SdfModels::pose_of(const Element& asked, const std::string& name) {
  return local_pose(asked, name, {}, 0);
}

Result<Pose> SdfModels::pose_in(const Scoped& around, const Element& e, const std::string& frame) {
  RMP_TRY_ASSIGN(const Pose own, raw_pose(e));
  const std::string from = relative_to(e);
  if (from.empty() || full_name(around, from) == frame) return own;
  RMP_TRY_ASSIGN(const Pose base, pose_of(e, full_name(around, from)));
  RMP_TRY_ASSIGN(const Pose to, pose_of(e, frame));
  return spatial::compose(spatial::inverse(to), spatial::compose(base, own));
}

std::string SdfModels::link_of(std::string name) const {
  for (std::size_t k = 0; k <= frames_.size(); ++k) {
    if (name == "world") return name;
    const auto it = frames_.find(name);
    if (it == frames_.end()) return {};
    if (it->second.stands_on.empty()) return name;
    name = it->second.stands_on;
  }
  return {};
}

}  // namespace robomosp::robot_files
