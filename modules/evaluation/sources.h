// SPDX-License-Identifier: Apache-2.0
// Sources: what computations on a snapshot read (layer: application, evaluation).
#pragma once

#include "document/document.h"
#include "evaluation/derived.h"
#include "kernel/registry.h"

namespace robomosp::collision {
class CollisionCache;
}

namespace robomosp::evaluation {

struct Sources {
  const Registry& registry;
  Derived& derived;
  const document::Snapshot& snapshot;
  /// Asked for prepared ones; none = made anew.
  collision::CollisionCache* collision_models = nullptr;
};

}  // namespace robomosp::evaluation
