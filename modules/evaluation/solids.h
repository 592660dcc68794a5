// SPDX-License-Identifier: Apache-2.0
// Solids: results of CSG engines for trees - shapes, meshes, moments, sections - looked up by
// fingerprint (layer: application, evaluation). Internal to modules/evaluation. [any thread]
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_edges.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "evaluation/cache.h"
#include "evaluation/kept.h"
#include "kernel/file_cache.h"
#include "kernel/fingerprint.h"
#include "kernel/registry.h"

namespace robomosp::evaluation {

/// A CSG provider and its part of every key.
struct SolidEngine {
  std::shared_ptr<CsgEngine> csg;
  std::string name, version;
  /// Of all engine files, for values kept between runs; empty = none are kept.
  std::optional<Fingerprint> build = std::nullopt;
  bool is_mesh = false;   ///< works on triangles throughout
  bool is_plain = false;  ///< keeps meshes as they are and performs no operations
};

/// A solid that an engine has made.
struct MadeSolid {
  std::shared_ptr<const CsgShape> shape;
  Fingerprint key;
  SolidEngine engine;
  std::string stand_in;  ///< why it is an approximation by a substitute engine; "" = it is not
};

/// Errors of a tree name its nodes; those of a solid of the document also the solid. Results of
/// engines are checked; their failures are cached as well.
class Solids {
 public:
  Solids(const Registry& registry, Cache& cache) : registry_(registry), cache_(cache) {}
  /// Keeps results in files between runs; call it before any request.
  void keep_in(std::shared_ptr<FileCache> files) { files_ = std::move(files); }

  /// The program's engine.
  Result<SolidEngine> engine();
  /// The engine for imported meshes.
  Result<SolidEngine> mesh_engine();
  /// The engine that suits the tree: the mesh engine if the tree contains a mesh.
  Result<SolidEngine> engine_for(const CsgTree& tree);

  /// The solid's content, or an error if it is missing.
  static Result<const model::Solid*> solid_of(const document::Snapshot& s, SolidId id);
  /// The tree as engines see it, with plugins' primitives built.
  Result<CsgTree> tree_of(const model::Solid& solid, Progress& progress);
  Result<CsgTree> tree_of(const document::Snapshot& s, SolidId id, Progress& progress);

  /// Built by the engine that suits the tree; if the exact one could not verify its result, by the
  /// mesh engine. An imported mesh alone that no engine accepts as a solid is kept as it is.
  Result<MadeSolid> shape(const CsgTree& tree, Progress& progress);
  Result<MadeSolid> shape(const document::Snapshot& s, SolidId id, Progress& progress);
  /// Built by a mesh engine; parts that only an exact engine can build are passed to it as meshes
  /// with a bound of their deviation.
  Result<MadeSolid> shape_of_triangles(SolidEngine e, const CsgTree& tree, Progress& progress);

  /// Closed, except for meshes kept as they are; within `chord` of the exact surface [m].
  Result<std::shared_ptr<const Mesh>> mesh(const MadeSolid& s, double chord, Progress& progress);
  /// The same, by the mesh engine if the engine that suits the tree fails.
  Result<std::shared_ptr<const Mesh>> mesh(const CsgTree& tree, double chord, Progress& progress);
  /// The note on a solid that the mesh engine builds because the exact one failed.
  static std::string stand_in_text(const Error& why);
  Result<Moments> moments(const MadeSolid& s, Progress& progress);
  Result<std::shared_ptr<const std::vector<CsgFeature>>> features(const MadeSolid& s,
                                                                  Progress& progress);
  /// Its edges as curves, with places that are within `chord` [m] of them.
  Result<std::shared_ptr<const std::vector<CsgEdge>>> edges(const MadeSolid& s, double chord,
                                                            Progress& progress);
  /// The section of the solid in the plane z = 0 of `plane` (solid_T_plane), within `chord` [m].
  Result<std::shared_ptr<const CsgProfile>> section(const MadeSolid& s, const Pose& plane,
                                                    double chord, Progress& progress);
  /// As stored in an imported node.
  Result<std::shared_ptr<const CsgGeometry>> geometry(const MadeSolid& s, Progress& progress);
  /// The part of each placed solid that is not in those before it; all by the first one's engine.
  Result<CsgEngine::Partition> partition(const std::vector<MadeSolid>& shapes,
                                         const std::vector<Pose>& poses, Progress& progress);

  /// The cache keys of a shape and of a failure to build it.
  struct Keys {
    Fingerprint value, failure;
  };
  static Keys keys_of(const SolidEngine& e, const CsgTree& tree);
  static Fingerprint mesh_key(const Fingerprint& shape, const MeshQuality& quality);

  [[nodiscard]] Cache& cache() { return cache_; }

  /// The value of `key`, a result of an engine: from the cache, else from the files, else computed
  /// (Result<T>).
  template <class T, class Make, class Bytes>
  Result<std::shared_ptr<const T>> kept(std::string_view kind, const SolidEngine& e,
                                        const Fingerprint& key, const Progress& progress,
                                        Make&& make, Bytes&& bytes) {
    return cache_.get<T>(
        key, key, progress,
        [&]() -> Result<T> {
          if (T found{}; from_files(kind, e, key, found)) return found;
          const auto begin = std::chrono::steady_clock::now();
          Result<T> made = make();
          if (made.ok()) to_files(kind, e, key, *made, std::chrono::steady_clock::now() - begin);
          return made;
        },
        std::forward<Bytes>(bytes));
  }

 private:
  /// Values computed faster than this are few in a robot and many in a drag: only so many of them
  /// are kept per run.
  static constexpr std::chrono::milliseconds kSlow{2};
  static constexpr int kQuickOnes = 1000;

  [[nodiscard]] bool uses_files(const SolidEngine& e) const {
    return files_ && e.build && cache_.is_enabled();
  }
  [[nodiscard]] static Fingerprint file_key(const SolidEngine& e, const Fingerprint& key) {
    return Fingerprinter("of engine/1").add(key).add(*e.build).finish();
  }
  template <class T>
  bool from_files(std::string_view kind, const SolidEngine& e, const Fingerprint& key, T& out) {
    if (!uses_files(e)) return false;
    const Fingerprint name = file_key(e, key);
    const auto bytes = files_->read(kind, name);
    if (!bytes) return false;
    if (from_bytes(*bytes, out)) return true;
    files_->refuse(kind, name);
    return false;
  }
  template <class T>
  void to_files(std::string_view kind, const SolidEngine& e, const Fingerprint& key, const T& value,
                std::chrono::steady_clock::duration took) {
    if (!uses_files(e) || (took < kSlow && ++quick_ones_ > kQuickOnes)) return;
    files_->write(kind, file_key(e, key), to_bytes(value));
  }
  /// The engine's native shape of a solid with facts from the files.
  Result<std::shared_ptr<const CsgShape>> evaluated(const MadeSolid& s, Progress& progress);
  Result<std::shared_ptr<const CsgShape>> evaluate(const SolidEngine& e, const CsgTree& tree,
                                                   Progress& progress);

  struct Known {
    std::optional<SolidEngine> engine;
    std::uint64_t revision = 0;
  };
  template <class Find>
  Result<SolidEngine> engine(Known& slot, Find&& find);
  /// The engine for exact solids.
  Result<SolidEngine> exact_engine();
  /// Built by the mesh engine instead, after a failure `why`.
  Result<MadeSolid> stand_in(const CsgTree& tree, const Error& why, Progress& progress);
  Result<MadeSolid> shape(SolidEngine e, const CsgTree& tree, Progress& progress);
  /// An imported mesh kept as it is, with the reason why it is not a solid.
  Result<MadeSolid> as_it_is(const CsgTree& tree, const Error& why, Progress& progress);
  /// The closed mesh of an exact solid in its own frame.
  Result<std::shared_ptr<const CsgGeometry>> triangulated(const SolidEngine& exact,
                                                          const CsgTree& branch,
                                                          Progress& progress);

  const Registry& registry_;
  Cache& cache_;
  std::shared_ptr<FileCache> files_;  ///< null = nothing is kept between runs
  std::atomic<int> quick_ones_{0};    ///< written so far
  std::mutex mutex_;
  Known known_, known_mesh_, known_exact_;  // guarded by mutex_
};

/// The axis-aligned box around a placed solid.
[[nodiscard]] Result<std::array<Vec3, 2>> placed_box(const MadeSolid& solid, const Pose& placement);
/// Bytes that a mesh occupies.
[[nodiscard]] std::size_t mesh_bytes(const Mesh& mesh);

}  // namespace robomosp::evaluation
