// SPDX-License-Identifier: Apache-2.0
// Plugin program_readers: programs of controllers to IRL, behind robomosp.program_reader/1.
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/program_reader.h>
#include <robomosp/sdk/reader_offers.h>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

/// What tells the languages apart that share an extension.
std::int32_t claim(const SourceFile& file, std::initializer_list<const char*> words) {
  for (const char* word : words)
    if (has_line(file.text.substr(0, 200'000), word)) return 2;
  return 1;
}

template <class Language>
class Offers final : public ReaderOffers {
 public:
  [[nodiscard]] std::span<const char* const> folders() const override { return Language::kFolders; }
  Result<std::vector<std::string>> offers(const SourceFile& file) const override {
    return Language::offers(file);
  }
};

template <class Language>
class Of final : public ProgramReader {
 public:
  [[nodiscard]] const void* extension(const char* id) const override {
    if constexpr (requires { Language::kFolders; }) {
      static const Offers<Language> kOffers;
      if (std::string_view(id) == ReaderOffers::kExtensionId)
        return static_cast<const ReaderOffers*>(&kOffers);
    }
    return nullptr;
  }
  [[nodiscard]] std::span<const ReaderFormat> formats() const override {
    return Language::kFormats;
  }
  [[nodiscard]] std::int32_t claims(const SourceFile& file) const override {
    return Language::claims(file);
  }
  Result<std::vector<std::string>> needs(const SourceFile& file) const override {
    return Language::needs(file);
  }
  Result<std::unique_ptr<ReadProgram>> read(const ProgramReaderTask& task, const Params& params,
                                            Progress& progress) const override {
    return Language::read(task, params, progress);
  }
};
struct Alone {
  static std::vector<std::string> needs(const SourceFile&) { return {}; }
};

struct Krl {
  static constexpr ReaderFormat kFormats[] = {{"src", "KUKA KRL"}, {"dat", "KUKA KRL, data"}};
  static std::int32_t claims(const SourceFile& f) {
    return claim(f, {"def", "deffct", "defdat", "&access", "global def"});
  }
  static constexpr const char* kFolders[] = {"system", "program"};
  static std::vector<std::string> needs(const SourceFile& f) { return krl_needs(f); }
  static std::vector<std::string> offers(const SourceFile& f) { return krl_offers(f); }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_krl(t, p, g);
  }
};
struct Rapid {
  static constexpr ReaderFormat kFormats[] = {{"mod", "ABB RAPID"},
                                              {"prg", "ABB RAPID"},
                                              {"sys", "ABB RAPID, system module"},
                                              {"pgf", "ABB RAPID, list of a program's modules"}};
  static std::int32_t claims(const SourceFile& f) { return claim(f, {"module", "%%%", "proc"}); }
  static constexpr const char* kFolders[] = {"progmod", "sysmod"};
  static std::vector<std::string> offers(const SourceFile& f) {
    return extension(f.name) == "pgf" ? std::vector<std::string>{} : rapid_offers(f);
  }
  /// The modules of a .pgf; and of a module CalibData, where RobotStudio keeps tools and objects.
  static std::vector<std::string> needs(const SourceFile& f) {
    if (extension(f.name) != "pgf" ||
        lower(f.text.substr(0, 4000)).find("<program") == std::string::npos)
      return rapid_needs(f);
    std::vector<std::string> out;
    const std::string low = lower(f.text);
    for (std::size_t at = low.find("<module>"); at != std::string::npos;
         at = low.find("<module>", at + 8)) {
      const std::size_t end = low.find('<', at + 8);
      if (end == std::string::npos) break;
      std::string name(f.text.substr(at + 8, end - at - 8));
      const std::size_t folder = name.find_last_of("/\\");
      if (folder != std::string::npos) name.erase(0, folder + 1);
      if (!name.empty() && name.size() < 64 && out.size() < 200) out.push_back(std::move(name));
    }
    return out;
  }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_rapid(t, p, g);
  }
};
struct Urscript : Alone {
  static constexpr ReaderFormat kFormats[] = {{"script", "Universal Robots URScript"},
                                              {"urscript", "Universal Robots URScript"}};
  static std::int32_t claims(const SourceFile& f) { return claim(f, {"def", "movej", "movel"}); }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_urscript(t, p, g);
  }
};
struct Tp {
  static constexpr ReaderFormat kFormats[] = {{"ls", "FANUC TP"}};
  static std::int32_t claims(const SourceFile& f) { return claim(f, {"/prog"}); }
  /// Programs that are called, and what a backup has of registers and frames.
  static std::vector<std::string> needs(const SourceFile& f) {
    if (extension(f.name) != "ls") return {};
    std::vector<std::string> out{"posreg.va", "numreg.va", "sysframe.va"};
    const std::string low = lower(f.text);
    for (std::size_t at = low.find("call "); at != std::string::npos;
         at = low.find("call ", at + 5)) {
      const std::size_t end = low.find_first_of(" ;(\r\n\t", at + 5);
      const std::string name = low.substr(at + 5, end == std::string::npos ? end : end - at - 5);
      if (!name.empty() && name.size() < 64 && out.size() < 200) out.push_back(name + ".ls");
    }
    return out;
  }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_tp(t, p, g);
  }
};
struct Melfa {
  static constexpr ReaderFormat kFormats[] = {{"prg", "Mitsubishi MELFA-BASIC"},
                                              {"mb4", "Mitsubishi MELFA-BASIC IV"},
                                              {"mb5", "Mitsubishi MELFA-BASIC V"}};
  static std::int32_t claims(const SourceFile& f) { return looks_like_melfa(f.text) ? 2 : 1; }
  /// Programs that are called: CallP "NAME".
  static std::vector<std::string> needs(const SourceFile& f) {
    std::vector<std::string> out;
    const std::string low = lower(f.text);
    for (std::size_t at = low.find("callp"); at != std::string::npos;
         at = low.find("callp", at + 5)) {
      const std::size_t begin = low.find_first_not_of(" \t", at + 5);
      if (begin == std::string::npos || low[begin] != '"') continue;
      const std::size_t end = low.find_first_of("\"\r\n", begin + 1);
      if (end == std::string::npos || low[end] != '"') continue;
      const std::string name(f.text.substr(begin + 1, end - begin - 1));
      if (!name.empty() && name.size() < 64 && out.size() < 200 &&
          name.find_first_of("/\\") == std::string::npos)
        out.push_back(name + "." + std::string(extension(f.name)));
    }
    return out;
  }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_melfa(t, p, g);
  }
};
struct Val3 {
  static constexpr ReaderFormat kFormats[] = {{"pjx", "Staubli VAL3, application"},
                                              {"pgx", "Staubli VAL3, program"}};
  static std::int32_t claims(const SourceFile& f) {
    return claim(f, {"<project", "<programs", "<?xml"});
  }
  static std::vector<std::string> needs(const SourceFile& f) { return val3_needs(f); }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_val3(t, p, g);
  }
};
struct Gcode : Alone {
  static constexpr ReaderFormat kFormats[] = {
      {"ngc", "G-code"}, {"nc", "G-code"}, {"gcode", "G-code"}, {"tap", "G-code"}};
  static std::int32_t claims(const SourceFile&) { return 1; }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_gcode(t, p, g);
  }
};

struct As : Alone {
  static constexpr ReaderFormat kFormats[] = {{"as", "Kawasaki AS"}, {"pg", "Kawasaki AS"}};
  static std::int32_t claims(const SourceFile& f) {
    return claim(f, {".program", ".trans", ".joints"});
  }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_as(t, p, g);
  }
};
struct Pdl2 : Alone {
  static constexpr ReaderFormat kFormats[] = {{"pdl", "Comau PDL2"}};
  static std::int32_t claims(const SourceFile& f) { return claim(f, {"program", "routine"}); }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_pdl2(t, p, g);
  }
};
struct PacScript : Alone {
  static constexpr ReaderFormat kFormats[] = {{"pcs", "Denso PacScript"}};
  static std::int32_t claims(const SourceFile& f) {
    return claim(f, {"sub", "function", "takearm"});
  }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_pacscript(t, p, g);
  }
};
struct Inform {
  static constexpr ReaderFormat kFormats[] = {{"jbi", "Yaskawa INFORM"}};
  static std::int32_t claims(const SourceFile& f) { return claim(f, {"/job"}); }
  static std::vector<std::string> needs(const SourceFile& f) { return inform_needs(f); }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_inform(t, p, g);
  }
};
struct Movemaster : Alone {
  static constexpr ReaderFormat kFormats[] = {{"rm1", "Mitsubishi Movemaster RV-M1"}};
  static std::int32_t claims(const SourceFile&) { return 1; }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_movemaster(t, p, g);
  }
};
struct Crcl : Alone {
  static constexpr ReaderFormat kFormats[] = {{"xml", "NIST CRCL"}};
  static std::int32_t claims(const SourceFile& f) {
    return f.text.find("CRCLProgram") != std::string_view::npos ||
                   f.text.find("CRCLCommandInstance") != std::string_view::npos
               ? 2
               : 0;
  }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_crcl(t, p, g);
  }
};
struct JointTrajectory {
  static constexpr ReaderFormat kFormats[] = {{"yaml", "ROS JointTrajectory"},
                                              {"yml", "ROS JointTrajectory"},
                                              {"json", "ROS JointTrajectory"}};
  static std::int32_t claims(const SourceFile& f) { return looks_like_trajectory(f.text) ? 2 : 0; }
  static std::vector<std::string> needs(const SourceFile& f) { return trajectory_needs(f); }
  static Made read(const ProgramReaderTask& t, const Params& p, Progress& g) {
    return read_joint_trajectory(t, p, g);
  }
};

#define RMP_TCP_SPEED                                                                         \
  {                                                                                           \
    "tcp_speed", "real", "m/s",                                                               \
        "Speed of the tool for 100 % of a joint motion, if a controller gives joint motions " \
        "in mm/s.",                                                                           \
        "1", nullptr, 0.001, 100                                                              \
  }
const rmp_param kRapidParams[] = {RMP_TCP_SPEED};
const rmp_param kAsParams[] = {
    RMP_TCP_SPEED,
    {"program", "string", "",
     "Program to read from the file, with those that it calls; empty = the one named like the "
     "file, else main, else the first that nothing calls.",
     "", nullptr, 1, 0}};
const rmp_param kPacParams[] = {RMP_TCP_SPEED,
                                {"fig_xor", "int", "",
                                 "Configuration of the arm when it reaches forward with its elbow "
                                 "up and its wrist not flipped.",
                                 "5", nullptr, 0, 7}};
const rmp_param kTpParams[] = {
    RMP_TCP_SPEED,
    {"max_speed", "real", "m/s", "Path speed for max_speed: the limit of the controller.", "2",
     nullptr, 0.001, 100}};
#define RMP_JOINT_SPEED                                                                           \
  {                                                                                               \
    "joint_speed", "real", "rad/s", "Speed of the joints at 100 %.", "180 deg/s", nullptr, 0.001, \
        100                                                                                       \
  }
#define RMP_C_PTP_MM                                                            \
  {                                                                             \
    "c_ptp_mm", "real", "m",                                                    \
        "Distance from the target for 100 % of C_PTP, if a controller gives a " \
        "distance for a joint motion.",                                         \
        "100 mm", nullptr, 0.001, 10                                            \
  }
const rmp_param kMelfaParams[] = {RMP_C_PTP_MM};
const rmp_param kUrscriptParams[] = {RMP_JOINT_SPEED, RMP_C_PTP_MM};
const rmp_param kInformParams[] = {
    {"pulses", "real[]", "",
     "Pulses per degree (or mm) of each axis, then of additional ones; by default those of the "
     "controller's record, if given.",
     nullptr, nullptr, 1, 0, RMP_OPTIONAL},
    {"pl_mm", "real", "m", "Distance of a positioning level PL of a path.", "10 mm", nullptr, 0,
     1}};
const rmp_param kMovemasterParams[] = {
    {"speed", "real", "m/s", "Speed of the hand on straight motions at SP 9.", "1 m/s", nullptr,
     0.001, 10},
    {"roll", "real", "rad", "Roll shown by the drive unit when the tool's y axis is level.",
     "0 deg", nullptr, -7, 7}};
const rmp_param kCrclParams[] = {RMP_TCP_SPEED, RMP_JOINT_SPEED};
const rmp_param kJointTrajectoryParams[] = {
    {"joints", "string", "",
     "Names of the joints in the order of the robot, separated by commas; empty: the order of "
     "joint_names.",
     "", nullptr, 1, 0},
    {"linear", "string", "", "Names of the joints in m, separated by commas.", "", nullptr, 1, 0}};

}  // namespace
}  // namespace robomosp::readers

using namespace robomosp::readers;

RMP_PLUGIN("org.robomosp.program_readers", "1.0.0", "Apache-2.0",
           "Reads programs of KUKA, ABB, Universal Robots, FANUC, Mitsubishi, Staubli, Kawasaki, "
           "Comau, Denso and Yaskawa, G-code, CRCL and ROS as IRL.",
           RMP_PROVIDER_NO_PARAMS(Of<Krl>, "krl", "KUKA KRL: .src with its .dat.", ""),
           RMP_PROVIDER(Of<Rapid>, "rapid", "ABB RAPID: modules .mod, .prg, .sys; .pgf.", "",
                        kRapidParams),
           RMP_PROVIDER(Of<Urscript>, "urscript", "Universal Robots URScript: .script, .urscript.",
                        "", kUrscriptParams),
           RMP_PROVIDER(Of<Tp>, "tp", "FANUC TP: .ls.", "", kTpParams),
           RMP_PROVIDER(Of<Melfa>, "melfa", "Mitsubishi MELFA-BASIC IV and V: .prg.", "",
                        kMelfaParams),
           RMP_PROVIDER_NO_PARAMS(Of<Val3>, "val3",
                                  "Staubli VAL3: an application's .pjx, .dtx, .pgx.", ""),
           RMP_PROVIDER(Of<As>, "as", "Kawasaki AS: .as, .pg.", "", kAsParams),
           RMP_PROVIDER_NO_PARAMS(Of<Pdl2>, "pdl2", "Comau PDL2: .pdl.", ""),
           RMP_PROVIDER(Of<PacScript>, "pacscript", "Denso PacScript: .pcs.", "", kPacParams),
           RMP_PROVIDER_NO_PARAMS(Of<Gcode>, "gcode", "G-code (RS274): .ngc, .nc, .gcode.", ""),
           RMP_PROVIDER(Of<Inform>, "inform",
                        "Yaskawa INFORM: jobs .jbi with TOOL.CND, UFRAME.CND.", "", kInformParams),
           RMP_PROVIDER(Of<Movemaster>, "movemaster", "Mitsubishi Movemaster RV-M1: .rm1.", "",
                        kMovemasterParams),
           RMP_PROVIDER(Of<Crcl>, "crcl", "NIST CRCL: a CRCLProgram in .xml.", "", kCrclParams),
           RMP_PROVIDER(Of<JointTrajectory>, "joint_trajectory",
                        "ROS trajectory_msgs/JointTrajectory: .yaml, .json, and sequences of them.",
                        "", kJointTrajectoryParams))
