#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes every picture of docs/images again, by the demos that stand below with what each gives.
# usage: scripts/make_pictures.sh [--list] [PROGRAM [FOLDER]]
#   PROGRAM  robomosp; build/release/bin/robomosp when left out
#   FOLDER   where the pictures go; docs/images when left out
#   --list   only names the pictures
# Ends with 1 if one could not be made, and names it; the picture of before then stays.
set -u
source_folder=$(cd "$(dirname "$0")/.." && pwd)

# demo, its arguments after the folder; then each picture, with the name the demo gives it after "=".
recipes() {
  cat <<'LIST'
pa10_circle: pa10_torques
manual_pictures normal: pa10_circle solids_link solids_link_50 solids_link_cut solids_oval kinematics_ellipsoids kinematics_stretched recording_limits recording_log recording_over recording_path
solid_pictures normal: solid_assembly_section solid_com solid_exploded solid_flat solid_frames solid_front_top solid_hidden_dashed solid_hidden_line solid_section solid_section_drawing solid_smooth solid_wireframe
ik_pictures normal: ik_puma_eight
mechanism_pictures normal: mechanism_delta mechanism_dual_arm mechanism_four_bar mechanism_gripper mechanism_satellite_arm mechanism_stewart
collision_pictures normal: collision_nearest collision_touching
path_faults normal: path_too_far path_too_low
joint_motions: joint_motion_profiles joint_motion_spline joint_motion_time_optimal
trajectory_pictures: trajectory_curves trajectory_laws trajectory_orientations trajectory_splines trajectory_transition_speed trajectory_transitions
motion: simulation_energy=double_pendulum_energy simulation_stick_slip=stick_slip simulation_stick_slip_friction=stick_slip_friction
workspace normal 20: workspace_pa10_manipulability workspace_pa10_reachability workspace_pa10_section workspace_puma560_clear workspace_puma560_manipulability workspace_puma560_slice
closed_chains normal: closed_chains_6
floating_base normal: floating_base_swung
two_arms normal: two_arms_25
redundant_arm normal: redundant_arm_clearance
plan_around normal: plan_around=plan_around_2
pass_part normal: pass_part_belt pass_part_middle
cooperation_pictures normal: cooperation_taken
pick_and_place normal: pick_and_place_carried pick_and_place_fingers
palletising normal: palletising_carried
welding normal: welding_large_tube welding_small_tube
story_pictures normal: programmer_cell researcher_error researcher_steps student_arm student_torques
bridge_pictures: bridge_residual
check_pictures normal: check_faults check_plot check_weld
program_pictures normal: program_hanoi_pa10 program_hanoi_puma560 program_hanoi_ur5 program_palletising program_pick_and_place program_two_robots program_weave program_weld
library_pictures normal: library_robots library_parts tools_library
LIST
}

if [ "${1:-}" = --list ]; then
  recipes | sed 's/^[^:]*: *//' | tr ' ' '\n' | sed 's/=.*//; s/$/.png/'
  exit 0
fi
program=$(realpath "${1:-$source_folder/build/release/bin/robomosp}")
folder=$(realpath "${2:-$source_folder/docs/images}")
[ -x "$program" ] || { echo "there is no program $program; build robomosp first"; exit 1; }
[ -d "$folder" ] || { echo "there is no folder $folder"; exit 1; }
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
cd "$made" || exit 1
missing=0
while IFS=: read -r demo pictures; do
  read -r name arguments <<<"$demo"
  mkdir -p "$made/$name"
  echo "$name"
  # shellcheck disable=SC2086  # several arguments
  "$program" run "$source_folder/scripts/demos/$name.lua" "$made/$name" $arguments >"$made/$name.txt" 2>&1 </dev/null ||
    { tail -3 "$made/$name.txt"; missing=1; }
  for picture in $pictures; do
    if [ -f "$made/$name/${picture#*=}.png" ]; then
      cp "$made/$name/${picture#*=}.png" "$folder/${picture%%=*}.png"
    else
      echo "  ${picture%%=*}.png was not made: $(tail -1 "$made/$name.txt")"
      missing=1
    fi
  done
done < <(recipes)
exit $missing
