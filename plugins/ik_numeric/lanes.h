// SPDX-License-Identifier: Apache-2.0
// The fast search (layer: plugin): several searches of one chain in parallel, one per lane of the
// processor's vector registers; compiled for AVX-512, AVX2 and the baseline and selected at run
// time. Plain data only, so that no inline function of the library is compiled for a newer
// processor.
#pragma once

#include <cstddef>

namespace robomosp::ik_numeric {

/// One joint on the path to the tip.
struct LaneJoint {
  double R[9], p[3];  ///< placement: previous-path-joint_T_joint at q = 0
  double lower, upper;
  double unit;  ///< step unit of the search: 1 rad, or the chain's length for prismatic joints [m]
  bool slides;
};

struct LaneChain {
  const LaneJoint* joints;
  int size;               ///< of joints, >= 1
  double R[9], p[3];      ///< last joint_T_tip
  double inverse_length;  ///< 1 / the chain's length [1/m]
};

struct LaneOptions {
  int max_iterations = 100;
  double damping = 1e-2;   ///< factor of the squared error in the damping
  double max_step = 0.6;   ///< of one joint in one iteration [rad, or chain lengths]
  double position = 1e-9;  ///< tolerance [m]
  double rotation = 1e-9;  ///< tolerance, as the chord 2 sin(angle / 2)
  int patience = 8;        ///< steps with little gain before a search is abandoned
};

enum class LaneEnd { reached, stuck, out_of_iterations };

/// Source of work for the lanes, and sink of their results.
class LaneWork {
 public:
  /// Fills q (one value per joint, within the limits) and the target of a new search (R row-major);
  /// false if there is no more work for this lane now.
  virtual bool next(int lane, double* q, double* R, double* p) = 0;
  /// A search has ended at q; `cost` is its squared weighted error.
  virtual void done(int lane, LaneEnd end, const double* q, double cost, int iterations) = 0;
  /// True if the lane's search has become useless. Called when another lane has finished.
  virtual bool obsolete(int lane) = 0;
  /// True to stop everything. Called from time to time.
  virtual bool stopped() = 0;

 protected:
  ~LaneWork() = default;
};

/// One compiled form of the search.
struct LaneEngine {
  int width;  ///< parallel searches
  void (*run)(const LaneChain&, const LaneOptions&, LaneWork&, double* memory);
  const char* name;
};
/// Number of doubles that `run` needs, aligned to 64 bytes: q, trial, step and free, two Jacobians
/// of every lane, and a buffer for one lane's joint values.
constexpr std::size_t lane_memory(int joints, int width) {
  const auto n = static_cast<std::size_t>(joints);
  return (4 + 2 * 6) * n * static_cast<std::size_t>(width) + n;
}

/// The best variant for this processor.
const LaneEngine& lane_engine();

}  // namespace robomosp::ik_numeric
