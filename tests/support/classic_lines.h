// SPDX-License-Identifier: Apache-2.0
// Lines of the program of 2006 on a robot `arm`, an object `bolt` and a trajectory `stroke` of a
// world `cell`, and such lines changed at random: other numbers, words left out or too many.
#pragma once

#include <iterator>
#include <random>
#include <string>
#include <vector>

namespace robomosp::test {

inline constexpr const char* kClassicLines[] = {
    "Worlds Create",
    "Worlds Create other",
    "IOIC::Worlds LsWorlds",
    "Worlds GetWorldId 1",
    "Worlds GetWorldIndex cell",
    "Worlds GetActiveWorld",
    "World cell LsPObjects",
    "World cell LsPRobots",
    "World cell LsPTrajectories",
    "World cell GetTargetId",
    "World cell GetPObjectId 1",
    "World cell GetPRobotId 1",
    "World cell GetPRobotIdDesc \"arm\"",
    "World cell GetPTrajectoryId 1",
    "World cell GetPRobotIndex arm",
    "World cell GetPTrajectoryIndex stroke",
    "World cell LoadPTrajectory none.tjc",
    "World cell WorldSimulate arm stroke",
    "World cell InvKineWorldSim arm stroke TIME_DELAY_OFF 1",
    "World cell InvDynWorldSim arm stroke TIME_DELAY_ON 0",
    "World cell InvKineFirstPoint arm stroke",
    "World cell InvKineNextPoint arm stroke",
    "World cell InvKinePrevPoint arm stroke",
    "World cell InvKineFinalPoint arm stroke",
    "World cell WorldfKineSim arm stroke",
    "World cell WorldfDynSim arm {0 0 0} 0.02",
    "World cell FwdDynWorldSim arm 0.02 0 0 0.1 runge_kutta4 0.001 {0 0 0}",
    "World cell FwdDynWorldSim arm 0.02 {0 0 0.1} TIME_DELAY_OFF runge_kutta4 0.001 0",
    "World cell FwdDynWorldSim arm 0.02 {0 0 0} 1 runge_kutta4 0.001 1 none.plot",
    "World cell ComputeBaseTjc arm stroke",
    "Transform cell.target Get mGlobal",
    "Transform bolt Set P1 0.5",
    "Transform bolt Add O2 30",
    "Transform bolt Set PType 2",
    "Transform bolt Set OType 4",
    "Transform bolt Set RType 1",
    "Transform bolt Get O3",
    "Transform arm.tool Add P3 1",
    "Transform arm.base Set OType 1",
    "PObject bolt vGetDynamicp",
    "PTrajectory stroke GetParameters",
    "PTrajectory stroke GetNumGenPoints",
    "PTrajectory stroke GetGenPoint 2",
    "PRobot arm AddLinks 1 2 0.01",
    "PRobot arm SetLinks 10 20 0.1",
    "PRobot arm SetLinks {10deg 0.2rad 3cm}",
    "PRobot arm vGetDynamicp",
    "PRobot arm mGetDHp",
    "PRobot arm mGetToolHMT",
    "PRobot arm GetToolTransformId",
    "PRobot arm GetDOF",
    "PRobot arm GetBaseType",
    "PRobot arm AddBaseTjc stroke",
    "PRobot arm GetBaseTjc",
    "PRobot arm GetBaseTjcId",
    "PRobot arm GetBaseNumGen",
    "PRobot arm FollowTarget",
    "PRobot arm Link 1 Add 5",
    "PRobot arm Link 3 Set 0.2",
    "PRobot arm Link 2 GetAngle",
    "PRobot arm Link 2 GetMinAngle",
    "PRobot arm GetMaxAngle 3",
    "PRobot arm Link 2 mGetLocal",
    "PRobot arm Link 2 mGetGlobal",
    "PRobot arm Link 2 vGetDHp",
    "PRobot arm LLRL mGetDHp",
    "PRobot arm LLRL mGetInJointp",
    "PRobot arm LLRL mSetInHMT 0.5 0.1 0.2 0 0 0.3",
    "PRobot arm LLRL mSetInHMT 1 0 0 0.4 0 1 0 0 0 0 1 0.2 0 0 0 1",
    "PRobot arm LLRL mGetInHMT",
    "PRobot arm LLRL mGetOutJointp",
    "PRobot arm LLRL mGetOutHMT",
    "PRobot arm LLRL FKine 0.1 0.2 0.3",
    "PRobot arm LLRL IKine 0.5 0.1 0.2 0 0 0.3",
    "PRobot arm LLRL IKine",
    "PRobot arm LLRL mJacobian Local",
    "PRobot arm LLRL mJacobian Global 0.1 0.2 0.3",
    "PRobot arm LLRL RotVec 1 0 0 0 1 0 0 0 1",
    "PRobot arm LLRL mGetOriginAngles",
    "PRobot arm LLRL mGetNestAngles",
    "ForceReDraw",
};

/// A line of the table, with one to three changes most of the time.
inline std::string changed_classic_line(std::mt19937& random) {
  static const char* const kWords[] = {"nan",
                                       "inf",
                                       "-inf",
                                       "0",
                                       "-1",
                                       "1",
                                       "2",
                                       "1e308",
                                       "-1e308",
                                       "1e300",
                                       "1e19",
                                       "1e-320",
                                       "4e9",
                                       "0.5",
                                       "90",
                                       "1000000",
                                       "-0",
                                       "0x10",
                                       "30deg",
                                       "5mm",
                                       "1e999deg",
                                       "{",
                                       "}",
                                       "{}",
                                       "{0 0 0}",
                                       "\"\"",
                                       "\"open",
                                       "arm",
                                       "cell",
                                       "stroke",
                                       "bolt",
                                       "home",
                                       "Link",
                                       "LLRL",
                                       "id=arm",
                                       "q=here",
                                       "angles=degrees",
                                       "first=7",
                                       "index=1",
                                       "IOIC::",
                                       "a.b.c",
                                       "./x.plot",
                                       "TIME_DELAY_ON",
                                       "\x80\xff",
                                       "\\",
                                       "=",
                                       "#1",
                                       "recording#1"};
  const auto pick = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  std::vector<std::string> words;
  const std::string line = kClassicLines[pick(std::size(kClassicLines))];
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(' ', at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end + 1;
  }
  for (std::size_t n = pick(3); n > 0; --n) {
    const std::size_t at = pick(words.size());
    switch (pick(6)) {
      case 0: words[at] = kWords[pick(std::size(kWords))]; break;
      case 1:
        words.insert(words.begin() + static_cast<std::ptrdiff_t>(at),
                     kWords[pick(std::size(kWords))]);
        break;
      case 2:
        if (words.size() > 1) words.erase(words.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      case 3: words.insert(words.end(), 1 + pick(20), kWords[pick(std::size(kWords))]); break;
      case 4: {  // a number in the place of one, or of the last word
        std::size_t to = words.size() - 1;
        for (std::size_t i = at; i < words.size(); ++i)
          if (!words[i].empty() &&
              (words[i][0] == '-' || (words[i][0] >= '0' && words[i][0] <= '9'))) {
            to = i;
            break;
          }
        words[to] = kWords[pick(17)];
        break;
      }
      default:
        if (!words[at].empty()) words[at][pick(words[at].size())] = static_cast<char>(pick(256));
    }
  }
  std::string out;
  for (const std::string& w : words) out += (out.empty() ? "" : " ") + w;
  return out;
}

}  // namespace robomosp::test
