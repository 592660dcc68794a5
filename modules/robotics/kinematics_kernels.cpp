// SPDX-License-Identifier: Apache-2.0
// Compiled by robomosp_lanes(): frames of joints along a path, one configuration a lane.
#include "robotics/kinematics_kernels.h"

#include "spatial/lane_angles.h"
#include "spatial/lane_math.h"

namespace robomosp::robotics::kernels::RMP_LANES {
namespace {

using namespace spatial::RMP_LANES;
using spatial::JointConstants;
using spatial::Turn;

// base_T_joint by the axes of the joint's frame.
struct Frame {
  Vec<Lanes> x, y, z, p;
};

struct Scratch {
  double *angle, *sine, *cosine;
  Lanes *q, *out;
  Frame* frames;
};
std::size_t lay_out(std::size_t joints, std::size_t coordinates, std::size_t dof, double* at,
                    Scratch& room) {
  constexpr std::size_t kAlignment = 64;
  if (at) {
    const auto address = reinterpret_cast<std::uintptr_t>(at);
    at += ((kAlignment - address % kAlignment) % kAlignment) / sizeof(double);
  }
  std::size_t used = 0;
  const auto take = [&](std::size_t numbers) {
    double* here = at ? at + used : nullptr;
    used += numbers * kLanes;
    return here;
  };
  room.angle = take(joints), room.sine = take(joints), room.cosine = take(joints);
  room.q = reinterpret_cast<Lanes*>(take(coordinates));
  const std::size_t jacobian = 6 * dof, poses = 12 * joints, pose = 12;
  const std::size_t most = jacobian > poses ? jacobian : poses;
  room.out = reinterpret_cast<Lanes*>(take(most > pose ? most : pose));
  room.frames = reinterpret_cast<Frame*>(take(12 * joints));
  return used + kAlignment / sizeof(double);
}

RMP_INLINE Vec<Lanes> combined(const Vec<Lanes>& a, const Lanes& s, const Vec<Lanes>& b,
                               const Lanes& t) {
  return {a.x * s + b.x * t, a.y * s + b.y * t, a.z * s + b.z * t};
}
template <class A>
RMP_INLINE Vec<Lanes> point(const Frame& f, const Vec<A>& v) {
  return {f.x.x * v.x + f.y.x * v.y + f.z.x * v.z, f.x.y * v.x + f.y.y * v.y + f.z.y * v.z,
          f.x.z * v.x + f.y.z * v.y + f.z.z * v.z};
}

// The frame of a joint from its parent's, of which only turn and place before the joint's own
// motion are constants.
template <Turn K>
RMP_INLINE void place(const JointConstants& k, const Frame& up, const Lanes* q, const Lanes& s,
                      const Lanes& c, Frame& f) {
  if constexpr (K != Turn::ball && K != Turn::general) {
    if (k.parent < 0) {  // most of the products are with zeros and ones
      const double turn = k.cos_twist, rise = k.sin_twist;
      f.p = vec<Lanes>(k.p);
      f.x = {c, s * turn, s * rise};
      f.y = {-s, c * turn, c * rise};
      f.z = {Lanes{}, splat<Lanes>(-rise), splat<Lanes>(turn)};
      if (k.type == JointType::prismatic)
        f.p = f.p + scaled(f.z, q[k.q_index] * k.ratio + k.offset);
      return;
    }
  }
  f.p = up.p + point(up, plain(k.p));
  if constexpr (K == Turn::ball) {
    const Lanes* own = q + k.q_index;
    if (k.type == JointType::free) {
      f.p = f.p + point(up, multiply(k.R, Vec<Lanes>{own[0], own[1], own[2]}));
      own += 3;
    }
    Lanes R[9];
    ball_rotation(k.R, own, R);
    f.x = point(up, Vec<Lanes>{R[0], R[3], R[6]});
    f.y = point(up, Vec<Lanes>{R[1], R[4], R[7]});
    f.z = point(up, Vec<Lanes>{R[2], R[5], R[8]});
    return;
  }
  Vec<Lanes> x = up.x, y = up.y;
  f.z = up.z;
  if constexpr (K == Turn::quarter) {
    y = up.z, f.z = scaled(up.y, -1.0);
  } else if constexpr (K == Turn::minus_quarter) {
    y = scaled(up.z, -1.0), f.z = up.y;
  } else if constexpr (K == Turn::twist) {
    y = scaled(up.y, k.cos_twist) + scaled(up.z, k.sin_twist);
    f.z = scaled(up.z, k.cos_twist) - scaled(up.y, k.sin_twist);
  } else if constexpr (K == Turn::general) {
    x = point(up, Vec<double>{k.R[0], k.R[3], k.R[6]});
    y = point(up, Vec<double>{k.R[1], k.R[4], k.R[7]});
    f.z = point(up, Vec<double>{k.R[2], k.R[5], k.R[8]});
  }
  f.x = combined(x, c, y, s);
  f.y = combined(y, c, x, -s);
  if (k.type == JointType::prismatic) f.p = f.p + scaled(f.z, q[k.q_index] * k.ratio + k.offset);
}

void place_path(const Task& task, const Scratch& x) {
  for (std::size_t i = 0; i < task.path_count; ++i) {
    const JointConstants& k = task.joints[task.path[i]];
    Lanes angle = splat<Lanes>(k.angle);
    if (k.type == JointType::revolute) angle += x.q[k.q_index] * k.ratio + k.offset;
    store(x.angle + i * kLanes, angle);
  }
  sin_cos<RightAngles::exact>(x.angle, task.path_count * kLanes, x.sine, x.cosine);
  const Lanes one = splat<Lanes>(1), zero{};
  const Frame base{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}, {zero, zero, zero}};
  for (std::size_t i = 0; i < task.path_count; ++i) {
    const JointConstants& k = task.joints[task.path[i]];
    const Frame& up = k.parent < 0 ? base : x.frames[k.parent];
    const Lanes s = load(x.sine + i * kLanes), c = load(x.cosine + i * kLanes);
    by_turn(k.turn,
            [&](auto kind) { place<kind.kTurn>(k, up, x.q, s, c, x.frames[task.path[i]]); });
  }
}

RMP_INLINE void write(const Frame& f, Lanes* to) {
  to[0] = f.x.x, to[1] = f.y.x, to[2] = f.z.x;
  to[3] = f.x.y, to[4] = f.y.y, to[5] = f.z.y;
  to[6] = f.x.z, to[7] = f.y.z, to[8] = f.z.z;
  to[9] = f.p.x, to[10] = f.p.y, to[11] = f.p.z;
}

Frame tip_frame(const Task& task, const Scratch& x) {
  const double *R = task.tool, *p = R + 9;
  if (task.path_count == 0)
    return {vec<Lanes>(R, 3), vec<Lanes>(R + 1, 3), vec<Lanes>(R + 2, 3), vec<Lanes>(p)};
  const Frame& f = x.frames[task.path[task.path_count - 1]];
  const bool apart = p[0] != 0 || p[1] != 0 || p[2] != 0;
  const Vec<Lanes> at = apart ? f.p + point(f, plain(p)) : f.p;
  if (R[0] == 1 && R[4] == 1 && R[8] == 1) return {f.x, f.y, f.z, at};
  return {point(f, Vec<double>{R[0], R[3], R[6]}), point(f, Vec<double>{R[1], R[4], R[7]}),
          point(f, Vec<double>{R[2], R[5], R[8]}), at};
}

void jacobian(const Task& task, const Scratch& x, const Frame& tip, Lanes* out) {
  const bool all = !task.coupled && task.path_count == task.joint_count;
  if (!all)
    for (std::size_t i = 0; i < 6 * task.dof; ++i) out[i] = Lanes{};
  const auto expressed = [&](const Vec<Lanes>& v) {
    if (task.in_tip) return Vec<Lanes>{dot(tip.x, v), dot(tip.y, v), dot(tip.z, v)};
    return task.turned_by ? multiply(task.turned_by, v) : v;
  };
  for (std::size_t i = 0; i < task.path_count; ++i) {
    const JointConstants& k = task.joints[task.path[i]];
    const Frame& f = x.frames[task.path[i]];
    const std::size_t down = task.by_rows ? task.dof : 1, along = task.by_rows ? 1 : 6;
    Lanes* column = out + along * static_cast<std::size_t>(k.v_index);
    const auto put = [&](std::size_t row, const Vec<Lanes>& v) {
      Lanes* at = column + row * down;
      if (task.coupled) {
        at[0] += v.x * k.ratio, at[down] += v.y * k.ratio, at[2 * down] += v.z * k.ratio;
      } else {
        at[0] = v.x, at[down] = v.y, at[2 * down] = v.z;
      }
    };
    const auto turn = [&](const Vec<Lanes>& axis) {
      put(0, expressed(cross(axis, tip.p - f.p)));
      put(3, expressed(axis));
    };
    const auto slide = [&](const Vec<Lanes>& axis) {
      put(0, expressed(axis));
      put(3, Vec<Lanes>{});
    };
    if (k.type == JointType::revolute) turn(f.z);
    if (k.type == JointType::prismatic) slide(f.z);
    if (k.type == JointType::free) {
      slide(f.x), column += along;
      slide(f.y), column += along;
      slide(f.z), column += along;
    }
    if (k.type == JointType::spherical || k.type == JointType::free) {
      turn(f.x), column += along;
      turn(f.y), column += along;
      turn(f.z);
    }
  }
}

void run(const Task& task, std::size_t samples, std::size_t first, std::size_t last,
         double* scratch) {
  Scratch x;
  lay_out(task.joint_count, task.coordinates, task.dof, scratch, x);
  for (std::size_t i = first; i < last; i += kLanes) {
    const std::size_t here = last - i < kLanes ? last - i : kLanes;
    load_samples(task.q + i * task.coordinates, task.coordinates, samples - i, x.q);
    place_path(task, x);
    if (task.frames) {
      for (std::size_t j = 0; j < task.joint_count; ++j) write(x.frames[j], x.out + 12 * j);
      const std::size_t width = 12 * task.joint_count;
      store_samples(x.out, width, here, task.frames + i * width);
      continue;
    }
    const Frame tip = tip_frame(task, x);
    if (task.poses) {
      write(tip, x.out);
      store_samples(x.out, 12, here, task.poses + 12 * i);
    }
    if (task.jacobians) {
      jacobian(task, x, tip, x.out);
      store_samples(x.out, 6 * task.dof, here, task.jacobians + 6 * task.dof * i);
    }
  }
}

std::size_t scratch_size(std::size_t joints, std::size_t coordinates, std::size_t dof) {
  Scratch x;
  return lay_out(joints, coordinates, dof, nullptr, x);
}

// The same angles as spatial::to_rpy, and the quaternion of spatial::to_quaternion.
RMP_INLINE void rpy_of(const Lanes* R, Lanes* out) {
  const Lanes zero{}, one = splat<Lanes>(1);
  const Lanes c = root_of(R[0] * R[0] + R[3] * R[3]);
  const auto apart = c > 1e-15;
  // Sine and cosine of yaw, times c, which an angle does not feel.
  const Lanes sine = select(apart, R[3], zero), cosine = select(apart, R[0], one);
  const auto turn = [](const Lanes& y, const Lanes& x) {  // half turns are +pi
    const Lanes a = angle<Lanes>(y, x);
    return select(a <= -kPi, splat<Lanes>(kPi), a);
  };
  out[0] = turn(sine * R[2] - cosine * R[5], cosine * R[4] - sine * R[1]);
  out[1] = angle<Lanes>(-R[6], c);
  out[2] = select(apart, turn(R[3], R[0]), zero);
}
RMP_INLINE void quaternion_of(const Lanes* R, Lanes* out) {
  const Lanes trace = R[0] + R[4] + R[8];
  const Lanes a = R[7] - R[5], b = R[2] - R[6], c = R[3] - R[1];
  const Lanes d = R[1] + R[3], e = R[2] + R[6], f = R[5] + R[7];
  // Shepperd's choice of the largest component; that one's square first, times it the others.
  Lanes square = 1 - R[0] - R[4] + R[8], w = c, x = e, y = f, z = square;
  const auto take = [&](auto which, const Lanes& s, const Lanes& qw, const Lanes& qx,
                        const Lanes& qy, const Lanes& qz) {
    square = select(which, s, square);
    w = select(which, qw, w), x = select(which, qx, x);
    y = select(which, qy, y), z = select(which, qz, z);
  };
  const Lanes sw = 1 + trace, sx = 1 + R[0] - R[4] - R[8], sy = 1 - R[0] + R[4] - R[8];
  take(R[4] >= R[8], sy, b, d, sy, f);
  take((R[0] >= R[4]) & (R[0] >= R[8]), sx, a, sx, d, e);
  take((trace >= R[0]) & (trace >= R[4]) & (trace >= R[8]), sw, sw, a, b, c);
  const Lanes length = root_of(w * w + x * x + y * y + z * z);
  const Lanes by = select(w < 0, -1 / length, 1 / length);
  out[0] = w * by, out[1] = x * by, out[2] = y * by, out[3] = z * by;
}

void describe(const double* poses, std::size_t count, const double* base, const PoseRows& to) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    const std::size_t here = count - i < kLanes ? count - i : kLanes;
    Lanes given[12], at[16];
    load_samples(poses + 12 * i, 12, count - i, given);
    Lanes turned[9], p[3] = {given[9], given[10], given[11]};
    const Lanes* turn = given;
    if (base) {
      for (std::size_t r = 0; r < 3; ++r) {
        const double* row = base + 3 * r;
        for (std::size_t c = 0; c < 3; ++c)
          turned[3 * r + c] = given[c] * row[0] + given[3 + c] * row[1] + given[6 + c] * row[2];
        p[r] = given[9] * row[0] + given[10] * row[1] + given[11] * row[2] + base[9 + r];
      }
      turn = turned;
    }
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) at[4 * r + c] = turn[3 * r + c];
      at[4 * r + 3] = p[r];
    }
    at[12] = at[13] = at[14] = Lanes{};
    at[15] = splat<Lanes>(1);
    store_samples(at, 16, here, to.matrices + 16 * i);
    store_samples(p, 3, here, to.positions + 3 * i);
    Lanes angles[3], turn4[4];
    rpy_of(turn, angles);
    store_samples(angles, 3, here, to.rpy + 3 * i);
    quaternion_of(turn, turn4);
    store_samples(turn4, 4, here, to.quaternions + 4 * i);
  }
}

// One configuration: sines and cosines of several joints at once, then joint after joint. Members
// of the model are read without the functions of std::array, see lanes.h.
void frames(const JointModel* joints, std::size_t count, const double* q, double* out) {
  constexpr std::size_t kChunk = 32;
  static_assert(kChunk % kLanes == 0);
  double angle[kChunk], sine[kChunk], cosine[kChunk];
  for (std::size_t first = 0; first < count; first += kChunk) {
    const std::size_t here = count - first < kChunk ? count - first : kChunk;
    const auto value = [&](const JointModel& j) {
      const double x = q[j.q_index];
      return j.coupling.of >= 0 ? j.coupling.ratio * x + j.coupling.offset : x;
    };
    for (std::size_t i = 0; i < here; ++i) {
      const JointModel& j = joints[first + i];
      angle[i] = j.type == JointType::revolute ? value(j) : 0;
    }
    for (std::size_t i = here; i % kLanes != 0; ++i) angle[i] = 0;
    sin_cos<RightAngles::exact>(angle, here, sine, cosine);
    for (std::size_t i = 0; i < here; ++i) {
      const JointModel& j = joints[first + i];
      const auto* t = reinterpret_cast<const double*>(&j.placement);
      double* f = out + 12 * (first + i);
      double p[3] = {t[9], t[10], t[11]}, ball[9];
      const double* R = t;
      if (j.type == JointType::prismatic) {
        const double way = value(j);
        p[0] += way * t[2], p[1] += way * t[5], p[2] += way * t[8];
      } else if (j.type != JointType::revolute) {
        const double* own = q + j.q_index;
        if (j.type == JointType::free) {
          for (std::size_t k = 0; k < 3; ++k)
            p[k] += t[3 * k] * own[0] + t[3 * k + 1] * own[1] + t[3 * k + 2] * own[2];
          own += 3;
        }
        ball_rotation(t, own, ball);
        R = ball;
      }
      const double s = sine[i], c = cosine[i];
      const double* up = j.parent < 0 ? nullptr : out + 12 * j.parent;
#pragma GCC unroll 3
      for (std::size_t r = 0; r < 3; ++r) {
        double x = R[3 * r], y = R[3 * r + 1], z = R[3 * r + 2], at = p[r];
        if (up) {
          const double a = up[3 * r], b = up[3 * r + 1], d = up[3 * r + 2];
          x = a * R[0] + b * R[3] + d * R[6];
          y = a * R[1] + b * R[4] + d * R[7];
          z = a * R[2] + b * R[5] + d * R[8];
          at = a * p[0] + b * p[1] + d * p[2] + up[9 + r];
        }
        f[3 * r] = x * c + y * s;
        f[3 * r + 1] = y * c - x * s;
        f[3 * r + 2] = z;
        f[9 + r] = at;
      }
    }
  }
}

constexpr Table kTable{run, scratch_size, frames, describe, kLanes};

}  // namespace

const Table& table() { return kTable; }

}  // namespace robomosp::robotics::kernels::RMP_LANES
