// SPDX-License-Identifier: Apache-2.0
// The parts of the module that python_code.cpp writes. The dynamics are recursive Newton-Euler
// (Luh, Walker, Paul, J. Dyn. Sys. Meas. Control 102, 1980), everything in the base's axes; the
// inertia by its columns, the accelerations by its Cholesky factor.
#pragma once

namespace python_code {

inline constexpr const char* kHead = R"py("""Kinematics and dynamics of a robot, written by ROBOMOSP. The code is yours.

SI units and radians. q, qd, qdd and tau hold a number for each joint, or a NumPy array of one
number a sample. Poses are (R, p): nine numbers row by row, and the origin, in the robot's base.
"""
from collections import namedtuple

try:
    from numpy import cos, sin, sqrt
except ImportError:
    from math import cos, sin, sqrt

# A joint turns about (or slides along) the z axis of its frame, which stands at `rotation` and
# `origin` in its parent's frame; mass, centre of mass and inertia about it are in its own frame.
Joint = namedtuple("Joint", "name parent slides rotation origin mass com inertia armature "
                            "friction spring")
)py";

inline constexpr const char* kVectors = R"py(

def _add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _scale(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _turn(R, v):
    return (_dot(R[0:3], v), _dot(R[3:6], v), _dot(R[6:9], v))


def _turn_back(R, v):
    return (_dot(R[0::3], v), _dot(R[1::3], v), _dot(R[2::3], v))


def _product(A, B):
    return tuple(_dot(A[3 * r:3 * r + 3], B[c::3]) for r in range(3) for c in range(3))


_BASE = ((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


def _frames(q):
    """(R, p) of every joint's frame."""
    frames = []
    for j, x in zip(JOINTS, q):
        R, p = frames[j.parent] if j.parent >= 0 else _BASE
        p = _add(p, _turn(R, j.origin))
        R = _product(R, j.rotation)
        if j.slides:
            p = _add(p, _scale(R[2::3], x))
        else:
            c, s = cos(x), sin(x)
            R = _product(R, (c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0))
        frames.append((R, p))
    return frames


def _tip(frames, tip):
    _, joint, rotation, origin = tip
    R, p = frames[joint] if joint >= 0 else _BASE
    return _product(R, rotation), _add(p, _turn(R, origin))
)py";

inline constexpr const char* kForwardKinematics = R"py(

def forward_kinematics(q):
    """Poses (R, p) of all tips."""
    frames = _frames(q)
    return [_tip(frames, tip) for tip in TIPS]
)py";

inline constexpr const char* kJacobian = R"py(

def jacobian(q):
    """Of the first tip: 6 rows of a number a joint, velocity and angular velocity."""
    frames = _frames(q)
    at = _tip(frames, TIPS[0])[1]
    columns = [(0.0,) * 6] * len(JOINTS)
    k = TIPS[0][1]
    while k >= 0:
        R, p = frames[k]
        z = R[2::3]
        columns[k] = (*z, 0.0, 0.0, 0.0) if JOINTS[k].slides else (*_cross(z, _sub(at, p)), *z)
        k = JOINTS[k].parent
    return [[column[r] for column in columns] for r in range(6)]
)py";

inline constexpr const char* kInverseDynamics = R"py(

def _newton_euler(frames, qd, qdd, gravity):
    """Torques of weight, inertia and velocity."""
    w, dw, a = [], [], []
    still = (0.0, 0.0, 0.0)
    for k, j in enumerate(JOINTS):
        (R, p), z = frames[k], frames[k][0][2::3]
        i = j.parent
        arm = _sub(p, frames[i][1]) if i >= 0 else p
        w0, dw0, a0 = (w[i], dw[i], a[i]) if i >= 0 else (still, still, _scale(gravity, -1.0))
        now = _add(a0, _add(_cross(dw0, arm), _cross(w0, _cross(w0, arm))))
        if j.slides:
            w.append(w0)
            dw.append(dw0)
            a.append(_add(now, _add(_scale(_cross(w0, z), 2.0 * qd[k]), _scale(z, qdd[k]))))
        else:
            w.append(_add(w0, _scale(z, qd[k])))
            dw.append(_add(dw0, _add(_scale(z, qdd[k]), _scale(_cross(w0, z), qd[k]))))
            a.append(now)
    force, moment = [still] * len(JOINTS), [still] * len(JOINTS)  # at the joints' origins
    tau = [0.0] * len(JOINTS)
    for k in range(len(JOINTS) - 1, -1, -1):
        j, (R, p) = JOINTS[k], frames[k]
        c = _turn(R, j.com)
        f = _scale(_add(a[k], _add(_cross(dw[k], c), _cross(w[k], _cross(w[k], c)))), j.mass)
        spin = _turn(R, _turn(j.inertia, _turn_back(R, w[k])))
        n = _add(_turn(R, _turn(j.inertia, _turn_back(R, dw[k]))), _cross(w[k], spin))
        force[k] = _add(force[k], f)
        moment[k] = _add(moment[k], _add(n, _cross(c, f)))
        tau[k] = _dot(R[2::3], force[k] if j.slides else moment[k]) + j.armature * qdd[k]
        if j.parent >= 0:
            arm = _sub(p, frames[j.parent][1])
            force[j.parent] = _add(force[j.parent], force[k])
            moment[j.parent] = _add(moment[j.parent], _add(moment[k], _cross(arm, force[k])))
    return tau


def inverse_dynamics(q, qd, qdd):
    """Joint torques and forces: weight, inertia, velocity, motors, friction and springs."""
    tau = _newton_euler(_frames(q), qd, qdd, GRAVITY)
    for k, j in enumerate(JOINTS):
        viscous, forward, backward = j.friction
        stiffness, rest = j.spring
        tau[k] = (tau[k] + viscous * qd[k] + forward * (qd[k] > 1e-9) + backward * (qd[k] < -1e-9)
                  + stiffness * (q[k] - rest))
    return tau
)py";

inline constexpr const char* kInertia = R"py(

def inertia(q):
    """Joint-space inertia with the motors', row by row."""
    frames, n = _frames(q), len(JOINTS)
    none = [0.0] * n
    columns = [_newton_euler(frames, none, [1.0 if r == c else 0.0 for r in range(n)],
                             (0.0, 0.0, 0.0)) for c in range(n)]
    # The columns' mean with the rows takes rounding out: it is symmetric to the bit.
    return [[0.5 * (columns[c][r] + columns[r][c]) for c in range(n)] for r in range(n)]
)py";

inline constexpr const char* kForwardDynamics = R"py(

def forward_dynamics(q, qd, tau):
    """Joint accelerations under the torques."""
    n = len(JOINTS)
    M = inertia(q)
    bias = inverse_dynamics(q, qd, [0.0] * n)
    x = [tau[k] - bias[k] for k in range(n)]
    L = [[0.0] * n for _ in range(n)]
    for r in range(n):
        for c in range(r + 1):
            s = M[r][c]
            for k in range(c):
                s = s - L[r][k] * L[c][k]
            L[r][c] = sqrt(s) if r == c else s / L[c][c]
        for k in range(r):
            x[r] = x[r] - L[r][k] * x[k]
        x[r] = x[r] / L[r][r]
    for r in range(n - 1, -1, -1):
        for k in range(r + 1, n):
            x[r] = x[r] - L[k][r] * x[k]
        x[r] = x[r] / L[r][r]
    return x
)py";

}  // namespace python_code
