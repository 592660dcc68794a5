// SPDX-License-Identifier: Apache-2.0
// Files that keep computed bytes from run to run: what is read is what was written or nothing,
// whatever happens to the files and whoever else writes.
#include "kernel/file_cache.h"

#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "evaluation/kept.h"
#include "support/mutator.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

Fingerprint key(int i) { return Fingerprinter("test/1").add(i).finish(); }

class FileCacheTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "robomosp-cache-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  FileCache::Options options(std::uint64_t limit = 1 << 20) {
    return {.folder = folder_ / "kept",
            .limit = limit,
            .build = Fingerprinter("build/1").finish(),
            .note = [this](const std::string& s) { notes_.push_back(s); }};
  }
  static std::string content(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void put(const fs::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
  }
  fs::path folder_;
  std::vector<std::string> notes_;
};

TEST_F(FileCacheTest, WhatWasWrittenIsReadByTheNextRun) {
  const std::string bytes("\0a\xff", 3);
  {
    FileCache cache(options());
    EXPECT_EQ(cache.read("mesh", key(1)), std::nullopt);
    cache.write("mesh", key(1), bytes);
    cache.write("mesh", key(2), "");
  }
  FileCache cache(options());
  EXPECT_EQ(cache.read("mesh", key(1)), bytes);
  EXPECT_EQ(cache.read("mesh", key(2)), "");
  EXPECT_EQ(cache.read("moments", key(1)), std::nullopt);
  EXPECT_EQ(cache.read("mesh", key(3)), std::nullopt);
  EXPECT_EQ(cache.state().hits, 2U);
  EXPECT_EQ(cache.state().files, 2U);
  EXPECT_TRUE(notes_.empty());
}

TEST_F(FileCacheTest, AnotherBuildFindsNothingAndSpoilsNothing) {
  FileCache mine(options());
  mine.write("mesh", key(1), "mine");
  FileCache::Options other = options();
  other.build = Fingerprinter("build/2").finish();
  FileCache theirs(other);
  EXPECT_EQ(theirs.read("mesh", key(1)), std::nullopt);
  theirs.write("mesh", key(1), "theirs");
  EXPECT_EQ(mine.read("mesh", key(1)), "mine");
  EXPECT_EQ(theirs.read("mesh", key(1)), "theirs");
  EXPECT_NE(FileCache::fingerprint_of_program(), Fingerprint{});
}

TEST_F(FileCacheTest, EveryByteCounts) {
  FileCache cache(options());
  const std::string bytes = "the bytes of a mesh, more than eight of them";
  cache.write("mesh", key(1), bytes);
  const fs::path file = cache.file_of("mesh", key(1));
  const std::string whole = content(file);
  for (std::size_t i = 0; i < whole.size(); ++i)
    for (const int bit : {0, 7}) {
      std::string damaged = whole;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
      put(file, damaged);
      notes_.clear();
      EXPECT_EQ(cache.read("mesh", key(1)), std::nullopt) << "byte " << i;
      ASSERT_EQ(notes_.size(), 1U) << "byte " << i;
      EXPECT_NE(notes_[0].find("computed again"), std::string::npos);
      EXPECT_FALSE(fs::exists(file)) << "byte " << i;
    }
  for (std::size_t size = 0; size < whole.size(); ++size) {
    put(file, whole.substr(0, size));
    EXPECT_EQ(cache.read("mesh", key(1)), std::nullopt) << size << " bytes";
  }
  put(file, whole + "x");
  EXPECT_EQ(cache.read("mesh", key(1)), std::nullopt);
  // Replaced by what is computed anew.
  cache.write("mesh", key(1), bytes);
  EXPECT_EQ(cache.read("mesh", key(1)), bytes);
}

TEST_F(FileCacheTest, WhatBelongsToSomethingElseIsRefused) {
  FileCache cache(options());
  cache.write("mesh", key(1), "one");
  cache.write("mesh", key(2), "two");
  fs::copy_file(cache.file_of("mesh", key(1)), cache.file_of("mesh", key(2)),
                fs::copy_options::overwrite_existing);
  EXPECT_EQ(cache.read("mesh", key(2)), std::nullopt);
  // A version of the format that is not ours.
  std::string later = content(cache.file_of("mesh", key(1)));
  later[12] = 2;
  put(cache.file_of("mesh", key(1)), later);
  EXPECT_EQ(cache.read("mesh", key(1)), std::nullopt);
  EXPECT_NE(notes_.back().find("another version"), std::string::npos) << notes_.back();
  // Links, folders and pipes in the place of a file.
  for (const int what : {0, 1, 2}) {
    const fs::path file = cache.file_of("mesh", key(3));
    fs::create_directories(file.parent_path());
    if (what == 0) fs::create_symlink("/etc/hostname", file);
    if (what == 1) fs::create_directory(file);
    if (what == 2) (void)::mkfifo(file.c_str(), 0600);
    ASSERT_TRUE(fs::exists(fs::symlink_status(file)));
    EXPECT_EQ(cache.read("mesh", key(3)), std::nullopt);
    fs::remove(file);
  }
}

TEST_F(FileCacheTest, WhatWasUsedLongestAgoGoesFirst) {
  const std::string bytes(10'000, 'x');
  FileCache cache(options(100'000));
  const auto wait = [] { std::this_thread::sleep_for(std::chrono::milliseconds(12)); };
  for (int i = 0; i < 9; ++i) cache.write("mesh", key(i), bytes), wait();
  EXPECT_EQ(cache.read("mesh", key(0)), bytes);  // used now
  wait();
  for (int i = 9; i < 12; ++i) cache.write("mesh", key(i), bytes), wait();
  EXPECT_LE(cache.state().bytes, 100'000U);
  EXPECT_EQ(cache.read("mesh", key(0)), bytes);
  EXPECT_EQ(cache.read("mesh", key(1)), std::nullopt);
  EXPECT_EQ(cache.read("mesh", key(11)), bytes);
  // What would take most of the room alone is not kept.
  cache.write("mesh", key(20), std::string(50'000, 'x'));
  EXPECT_EQ(cache.read("mesh", key(20)), std::nullopt);
  EXPECT_TRUE(notes_.empty());
}

TEST_F(FileCacheTest, ClearingRemovesWhatIsKeptAndNothingElse) {
  FileCache cache(options());
  for (int i = 0; i < 5; ++i) cache.write("mesh", key(i), "bytes");
  put(folder_ / "kept" / "letter.txt", "dear");
  const fs::path beside = cache.file_of("mesh", key(1)).parent_path() / "letter.txt";
  put(beside, "dear");
  EXPECT_EQ(cache.clear(), 5U);
  EXPECT_EQ(cache.state().files, 0U);
  EXPECT_TRUE(fs::exists(folder_ / "kept" / "letter.txt"));
  EXPECT_TRUE(fs::exists(beside));
  cache.write("mesh", key(1), "again");
  EXPECT_EQ(cache.read("mesh", key(1)), "again");
}

TEST_F(FileCacheTest, AFolderThatCannotBeUsedIsSaidOnce) {
  put(folder_ / "kept", "a file where the folder should be");
  FileCache cache(options());
  for (int i = 0; i < 3; ++i) {
    cache.write("mesh", key(i), "bytes");
    EXPECT_EQ(cache.read("mesh", key(i)), std::nullopt);
  }
  ASSERT_EQ(notes_.size(), 1U);
  EXPECT_NE(notes_[0].find("Nothing is kept in"), std::string::npos);
  EXPECT_EQ(FileCache({.folder = {}}).read("mesh", key(1)), std::nullopt);
}

/// The bytes that a writer puts under a key, long enough to be seen half-way.
std::string long_bytes(int i) {
  return std::string(200'000, static_cast<char>('a' + i % 26)) + std::to_string(i);
}

TEST_F(FileCacheTest, SeveralProgramsAndThreadsWriteOneFolder) {
  constexpr int kKeys = 6, kRounds = 60;
  const auto work = [&](unsigned seed, std::atomic<int>& wrong) {
    // Too small for all, so that files are removed under each other's eyes.
    FileCache cache({.folder = folder_ / "kept",
                     .limit = 900'000,
                     .build = Fingerprinter("build/1").finish(),
                     .note = [&](const std::string&) { ++wrong; }});
    std::minstd_rand random(seed);
    for (int round = 0; round < kRounds; ++round) {
      const int i = static_cast<int>(random() % kKeys);
      if (const auto found = cache.read("mesh", key(i)); found && *found != long_bytes(i)) ++wrong;
      cache.write("mesh", key(i), long_bytes(i));
      if (round % 20 == 19) cache.clear();
    }
  };
  std::vector<pid_t> children;
  for (unsigned child = 0; child < 3; ++child) {
    const pid_t pid = ::fork();
    ASSERT_GE(pid, 0);
    if (pid == 0) {
      std::atomic<int> wrong{0};
      work(child + 1, wrong);
      ::_exit(wrong == 0 ? 0 : 1);
    }
    children.push_back(pid);
  }
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 2; ++t) threads.emplace_back([&, t] { work(10 + t, wrong); });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, 0);
  for (const pid_t pid : children) {
    int status = 0;
    ASSERT_EQ(::waitpid(pid, &status, 0), pid);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  std::size_t parts = 0;
  for (const auto& e : fs::recursive_directory_iterator(folder_))
    if (e.path().extension() == ".part") ++parts;
  EXPECT_EQ(parts, 0U);
}

TEST_F(FileCacheTest, NotesOfSeveralThreadsAreToldOneAtATime) {
  constexpr int kKeys = 400;
  std::atomic<int> within{0}, together{0};
  int notes = 0;
  FileCache::Options o = options(std::uint64_t{64} << 20);
  o.note = [&](const std::string&) {
    if (++within > 1) ++together;
    std::this_thread::sleep_for(std::chrono::microseconds(50));
    ++notes;
    --within;
  };
  FileCache cache(o);
  for (int i = 0; i < kKeys; ++i) {
    cache.write("mesh", key(i), "bytes");
    put(cache.file_of("mesh", key(i)), "nonsense");
  }
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int i = t; i < kKeys; i += 4) EXPECT_FALSE(cache.read("mesh", key(i)));
    });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(notes, kKeys);
  EXPECT_EQ(together, 0);
}

TEST_F(FileCacheTest, TheFolderIsChosenByTheEnvironment) {
  const auto with = [](const char* name, const char* value, auto&& fn) {
    const char* before = std::getenv(name);
    const std::string kept = before ? before : "";
    if (value) ::setenv(name, value, 1);
    else ::unsetenv(name);
    fn();
    if (before) ::setenv(name, kept.c_str(), 1);
    else ::unsetenv(name);
  };
  with("ROBOMOSP_CACHE", "off", [] { EXPECT_TRUE(FileCache::user_folder().empty()); });
  with("ROBOMOSP_CACHE", "/some/where",
       [] { EXPECT_EQ(FileCache::user_folder(), fs::path("/some/where")); });
  with("ROBOMOSP_CACHE", nullptr, [&] {
    with("XDG_CACHE_HOME", "/x",
         [] { EXPECT_EQ(FileCache::user_folder(), fs::path("/x/robomosp/geometry")); });
    with("XDG_CACHE_HOME", nullptr, [&] {
      with("HOME", "/h",
           [] { EXPECT_EQ(FileCache::user_folder(), fs::path("/h/.cache/robomosp/geometry")); });
      with("HOME", nullptr, [] { EXPECT_TRUE(FileCache::user_folder().empty()); });
    });
  });
  with("ROBOMOSP_CACHE_MIB", "3", [] { EXPECT_EQ(FileCache::user_limit(), 3U << 20); });
  with("ROBOMOSP_CACHE_MIB", "much", [] { EXPECT_EQ(FileCache::user_limit(), 512U << 20); });
}

// Geometry as bytes.

using evaluation::from_bytes;
using evaluation::ShapePiece;
using evaluation::SolidFacts;
using evaluation::to_bytes;

Mesh sample_mesh(std::mt19937& random) {
  Mesh m;
  std::uniform_real_distribution<float> number(-1, 1);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  const std::uint32_t vertices = 4 + below(20), triangles = 1 + below(30);
  for (std::uint32_t i = 0; i < 3 * vertices; ++i) {
    m.positions.push_back(number(random));
    m.normals.push_back(number(random));
  }
  for (std::uint32_t i = 0; i < 3 * triangles; ++i) m.triangles.push_back(below(vertices));
  m.faces = {{0, triangles, random()}, {triangles, 0, random()}};
  m.edge_sizes = {2, 1};
  for (int i = 0; i < 9; ++i) m.edge_points.push_back(number(random));
  return m;
}

std::vector<ShapePiece> sample_pieces(std::mt19937& random) {
  std::vector<ShapePiece> pieces(5);
  pieces[0].kind = ShapeKind::box;
  pieces[0].sizes = {0.1, -0.0, 1e-308};
  pieces[1].mesh = pieces[2].mesh = std::make_shared<const Mesh>(sample_mesh(random));
  pieces[2].kind = ShapeKind::convex;
  pieces[2].corners =
      std::make_shared<const std::vector<Vec3>>(std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}});
  pieces[2].cone = Vec3{0.1, 0, 0.2};
  pieces[3] = pieces[2];
  pieces[3].ellipsoid = Vec3{1, 2, 3};
  pieces[4].pose.p = {1, 2, 3};
  pieces[4].kind = ShapeKind::sphere;
  return pieces;
}

template <class T>
void expect_round_trip(const T& value) {
  const std::string bytes = to_bytes(value);
  T back{};
  ASSERT_TRUE(from_bytes(bytes, back));
  EXPECT_EQ(to_bytes(back), bytes);
  // Neither less nor more is a value.
  for (std::size_t n = 0; n < bytes.size(); n += 1 + bytes.size() / 200) {
    T none{};
    EXPECT_FALSE(from_bytes(std::string_view(bytes).substr(0, n), none)) << n;
  }
  T none{};
  EXPECT_FALSE(from_bytes(bytes + '\0', none));
}

TEST(GeometryBytes, EveryBitComesBack) {
  std::mt19937 random(1);
  expect_round_trip(SolidFacts{{{{-1, -0.0, 1e-300}, {1, 2, 3}}}, {"a note", ""}});
  const Mesh mesh = sample_mesh(random);
  expect_round_trip(mesh);
  Mesh back;
  ASSERT_TRUE(from_bytes(to_bytes(mesh), back));
  EXPECT_EQ(std::memcmp(back.positions.data(), mesh.positions.data(), 4 * mesh.positions.size()),
            0);
  EXPECT_EQ(back.triangles, mesh.triangles);
  EXPECT_EQ(back.faces[0].id, mesh.faces[0].id);
  Moments m;
  m.volume = 1.0 / 3;
  m.exact = false;
  m.second.yz = -0.0;
  m.relative_error = 1e-5;
  expect_round_trip(m);
  Moments m2;
  ASSERT_TRUE(from_bytes(to_bytes(m), m2));
  EXPECT_TRUE(std::signbit(m2.second.yz));
  CsgFeature f;
  f.kind = CsgFeature::Kind::corner;
  f.point = {1, 2, 3};
  f.inward = true;
  expect_round_trip(std::vector<CsgFeature>{{}, f});
  expect_round_trip(CsgEngine::Partition{{m, m2}, 0.25});
  const auto pieces = sample_pieces(random);
  expect_round_trip(pieces);
  std::vector<ShapePiece> read;
  ASSERT_TRUE(from_bytes(to_bytes(pieces), read));
  EXPECT_EQ(read[1].mesh, read[2].mesh);
  EXPECT_EQ(read[2].corners, read[3].corners);
  EXPECT_FALSE(read[0].mesh);
}

TEST(GeometryBytes, NonsenseIsNoValue) {
  std::mt19937 random(1);
  Mesh m = sample_mesh(random);
  m.triangles[0] = 1000;
  EXPECT_FALSE(from_bytes(to_bytes(m), m));
  m = sample_mesh(random);
  m.positions[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(from_bytes(to_bytes(m), m));
  m = sample_mesh(random);
  m.edge_sizes[0] = 4'000'000'000U;
  EXPECT_FALSE(from_bytes(to_bytes(m), m));
  auto pieces = sample_pieces(random);
  pieces[2].mesh.reset();
  EXPECT_FALSE(from_bytes(to_bytes(pieces), pieces));
  EXPECT_FALSE(from_bytes(std::string(64, '\xff'), pieces));
  EXPECT_FALSE(from_bytes(std::string(64, '\0'), m));  // a mesh without triangles
}

/// Mutated files, with the checksum as it was and with one that fits: the first are refused, the
/// second are a value that holds together or none.
TEST_F(FileCacheTest, MutatedFilesNeverMakeAWrongValue) {
  std::mt19937 random(test::seed());
  std::vector<std::string> samples;
  for (int i = 0; i < 4; ++i) {
    samples.push_back(to_bytes(sample_mesh(random)));
    samples.push_back(to_bytes(sample_pieces(random)));
    samples.push_back(to_bytes(SolidFacts{{{{0, 0, 0}, {1, 1, 1}}}, {"note"}}));
    samples.push_back(to_bytes(CsgEngine::Partition{{{}, {}}, 0}));
  }
  const char* const tokens[] = {"\xff\xff\xff\xff", "\x7f", "\x01"};
  test::Mutator mutator(random, samples, tokens);
  FileCache cache(options(std::uint64_t{1} << 30));
  const auto all_of = [](std::string_view bytes) {
    int made = 0;
    if (Mesh m; from_bytes(bytes, m)) {
      ++made;
      for (const auto i : m.triangles) EXPECT_LT(i, m.vertex_count());
    }
    if (std::vector<ShapePiece> p; from_bytes(bytes, p)) {
      ++made;
      for (const ShapePiece& piece : p) (void)piece.points();
    }
    if (SolidFacts f; from_bytes(bytes, f)) ++made;
    if (CsgEngine::Partition p; from_bytes(bytes, p)) ++made;
    if (std::vector<CsgFeature> f; from_bytes(bytes, f)) ++made;
    if (Moments m; from_bytes(bytes, m)) ++made;
    return made;
  };
  const test::FuzzBudget budget(400);
  for (std::size_t n = 0; budget.allows(n); ++n) {
    const std::string& bytes = samples[random() % samples.size()];
    cache.write("mesh", key(1), bytes);
    const fs::path file = cache.file_of("mesh", key(1));
    const std::string whole = content(file);
    const std::string mutated = mutator.mutate(whole);
    put(file, mutated);
    const auto read = cache.read("mesh", key(1));
    EXPECT_TRUE(read ? mutated == whole && *read == bytes : mutated != whole);
    (void)all_of(mutator.mutate(bytes));
    EXPECT_GE(all_of(bytes), 1);
  }
}

}  // namespace
}  // namespace robomosp
