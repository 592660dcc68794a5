// SPDX-License-Identifier: GPL-3.0-or-later
// Imported meshes as solids, kept while their geometry lives (layer: plugin).
#pragma once

#include <mutex>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/host.h>
#include <robomosp/sdk/result.h>

#include "exact_solid.h"

namespace robomosp::csg_cgal {

struct Import {
  ExactSolid solid;
  std::vector<std::string> repairs;
};

/// Checks and repairs of a big mesh take longer than cutting it, and a drag evaluates its tree
/// again for every position: what they gave is kept for as long as somebody holds the geometry.
/// [any thread]
class Imports {
 public:
  explicit Imports(const rmp_host* host) : host_(host) {}

  /// One imported solid; `key` goes into the ids of its faces.
  struct Wish {
    const CsgNode* node;
    std::uint64_t key;
  };
  /// One result a wish. Two and more that are not known yet are made at once, on the host's
  /// threads.
  std::vector<Result<Import>> get(const std::vector<Wish>& wishes);

 private:
  struct Known {
    std::weak_ptr<const CsgGeometry> geometry;
    double scale;
    std::uint64_t key;
    Import import;
  };
  std::optional<Import> find(const Wish& wish);
  void keep(const Wish& wish, const Import& import);

  Host host_;
  std::mutex mutex_;
  std::vector<Known> known_;  ///< guarded by mutex_; last used last
};

}  // namespace robomosp::csg_cgal
