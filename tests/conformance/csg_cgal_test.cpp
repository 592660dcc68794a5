// SPDX-License-Identifier: Apache-2.0
// The plugin csg_cgal: the conformance suite, imported meshes, repairs and degenerate operands.
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = ROBOMOSP_PLUGIN_DIR "/csg_cgal.so";

std::unique_ptr<CsgEngine> make_cgal() { return test::make_provider<CsgEngine>(kFile, "cgal"); }

INSTANTIATE_TEST_SUITE_P(Cgal, CsgConformance,
                         ::testing::Values(CsgSubject{"cgal", make_cgal,
                                                      test::open_plugin(kFile).providers[0].tags}),
                         [](const auto& subject) { return subject.param.name; });

}  // namespace
}  // namespace robomosp::conformance
