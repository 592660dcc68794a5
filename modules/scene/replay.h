// SPDX-License-Identifier: Apache-2.0
// Replay: a scene, its motion and columns of a recording as one self-contained HTML page (layer:
// application, scene). [any thread]
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"
#include "scene/playback.h"

namespace robomosp::scene {

/// Options of a replay besides the scene and its motion.
struct ReplayRequest {
  std::string title;
  double frame_rate = 30;                              ///< most poses kept per second, > 0
  render::Camera camera;                               ///< initial view of the page
  std::vector<const recording::Column*> columns = {};  ///< plotted over the playback's times
};

/// The data of a page, in two texts: `header` is JSON that lists all content in the order of its
/// numbers in `bytes`; scene/replay/decode.js reads them.
///
/// All numbers of `bytes` are whole and of seven bits a byte, the lowest first; signed ones are
/// folded (0, -1, 1, -2 as 0, 1, 2, 3). A list is written as its first number and the *steps* from
/// one to the next, or as *bends*, the first number, the first step and the steps of the steps.
///   meshes   x of all vertices, y, z in steps of 1/65535 of the mesh's box; two coordinates of the
///            normals on the unfolded octahedron in steps of 1/511; vertex numbers of the
///            triangles; sizes of the edges' polylines, then their x, y, z
///   tracks   for each moving body x, y, z [position_step], qw, qx, qy, qz [rotation_step] of all
///            frames, as bends; the sign of the quaternion does not jump
///   lines    x, y, z of the points [position_step], as bends
///   times    of the samples that are plotted [time_step], from the start, as bends
///   columns  steps of 1/65534 of low..high; 65535 where there is no number
struct ReplayData {
  std::string header;
  std::string bytes;
  std::size_t frames = 0;    ///< poses kept for every moving body
  double step = 0;           ///< time between them [s]
  double position_step = 0;  ///< of bodies [m]
};

/// Packs a scene with items and triads that move by the playback. Frames are equidistant in time,
/// both ends included, no closer than the playback's samples. Columns with more samples than a
/// screen shows keep the least and the greatest of each run of samples.
[[nodiscard]] Result<ReplayData> replay_data(const render::Scene&, const Playback&,
                                             const ReplayRequest&, Progress&);

/// A static scene, for a page that follows it: the parts that seldom change, with a fingerprint,
/// and separately the poses. The page keeps meshes by their keys, so that an edit sends only
/// changes.
struct SceneData {
  std::string shape;          ///< fingerprint of everything but the poses
  std::string header, bytes;  ///< as in ReplayData, of one frame; items and triads without poses
  std::vector<double> poses;  ///< x, y, z [m], qw, qx, qy, qz of each item of the header, then of
                              ///< each triad
};

/// Keys of meshes by their content, kept as long as the meshes. [any thread]
class MeshKeys {
 public:
  [[nodiscard]] std::string of(const std::shared_ptr<const Mesh>& mesh);

 private:
  std::mutex mutex_;
  std::map<std::weak_ptr<const Mesh>, std::string, std::owner_less<>> keys_;  // guarded by mutex_
  std::size_t cleaned_ = 64;  ///< number of keys at which those of deleted meshes are removed
};

/// Packs a scene. Header and bytes are empty if the shape is `known`; meshes with a key in `kept`
/// are listed without their numbers.
[[nodiscard]] SceneData scene_data(const render::Scene&, const render::Camera&, MeshKeys&,
                                   std::string_view known, const std::set<std::string>& kept);

/// The page of packed data: markup, style, scripts, data; it loads no other files. `is_watched`: it
/// reloads itself every other second, and keeps its position.
[[nodiscard]] std::string replay_page(const ReplayData&, const std::string& title,
                                      bool is_watched = false);

}  // namespace robomosp::scene
