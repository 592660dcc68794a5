// SPDX-License-Identifier: GPL-3.0-or-later
#include "imports.h"

#include <algorithm>
#include <exception>

#include "tessellate.h"

namespace robomosp::csg_cgal {
namespace {

/// Meshes that are kept at most.
constexpr std::size_t kMost = 16;

Result<Import> made(const Imports::Wish& wish, const Host& host) {
  std::vector<std::string> repairs;
  RMP_TRY_ASSIGN(ImportedMesh mesh,
                 imported_mesh(*wish.node->geometry, wish.node->sizes[0], wish.key, repairs, host));
  return Import{
      ExactSolid::from(std::move(mesh.mesh), std::move(mesh.neighbours), std::move(mesh.tree)),
      std::move(repairs)};
}

}  // namespace

std::optional<Import> Imports::find(const Wish& wish) {
  const std::lock_guard lock(mutex_);
  std::erase_if(known_, [](const Known& k) { return k.geometry.expired(); });
  const auto at = std::find_if(known_.begin(), known_.end(), [&](const Known& k) {
    return k.geometry.lock() == wish.node->geometry && k.scale == wish.node->sizes[0] &&
           k.key == wish.key;
  });
  if (at == known_.end()) return std::nullopt;
  std::rotate(at, at + 1, known_.end());
  return known_.back().import;
}

void Imports::keep(const Wish& wish, const Import& import) {
  const std::lock_guard lock(mutex_);
  if (known_.size() >= kMost) known_.erase(known_.begin());
  known_.push_back({wish.node->geometry, wish.node->sizes[0], wish.key, import});
}

std::vector<Result<Import>> Imports::get(const std::vector<Wish>& wishes) {
  std::vector<std::optional<Result<Import>>> all(wishes.size());
  std::vector<std::size_t> unknown;
  for (std::size_t i = 0; i < wishes.size(); ++i) {
    if (auto import = find(wishes[i])) all[i] = std::move(*import);
    else unknown.push_back(i);
  }
  // One mesh divides its own work, several are divided among the threads.
  const Host alone(nullptr);
  std::vector<std::exception_ptr> thrown(wishes.size());
  host_.spread(unknown.size(), host_.cores(), [&](std::size_t n) {
    const std::size_t i = unknown[n];
    try {
      all[i] = made(wishes[i], unknown.size() == 1 ? host_ : alone);
    } catch (...) {
      thrown[i] = std::current_exception();
    }
  });
  std::vector<Result<Import>> out;
  for (std::size_t i = 0; i < wishes.size(); ++i) {
    if (thrown[i]) std::rethrow_exception(thrown[i]);
    out.push_back(std::move(*all[i]));
  }
  for (const std::size_t i : unknown)
    if (out[i].ok()) keep(wishes[i], *out[i]);
  return out;
}

}  // namespace robomosp::csg_cgal
