// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/application.h"
#include "ioci/core/commands.h"

namespace robomosp::ioci {

void register_commands(CommandTable& table) {
  table.add(assembly_commands());
  table.add(collision_commands());
  table.add(document_commands());
  table.add(event_commands());
  table.add(exchange_commands());
  table.add(field_commands());
  table.add(file_commands());
  table.add(help_commands());
  table.add(history_commands());
  table.add(job_commands());
  table.add(mass_commands());
  table.add(material_commands());
  table.add(object_commands());
  table.add(parameter_commands());
  table.add(physics_commands());
  table.add(planning_commands());
  table.add(plugin_commands());
  table.add(record_commands());
  table.add(recording_commands());
  table.add(recovery_commands());
  table.add(recording_data_commands());
  table.add(replay_commands());
  table.add(robot_code_commands());
  table.add(robot_commands());
  table.add(robot_exchange_commands());
  table.add(robot_link_commands());
  table.add(robot_loop_commands());
  table.add(robot_kinematics_commands());
  table.add(robot_dynamics_commands());
  table.add(robot_motion_commands());
  table.add(robot_target_commands());
  table.add(robot_tool_commands());
  table.add(run_commands());
  table.add(simulation_commands());
  table.add(solid_commands());
  table.add(solid_feature_commands());
  table.add(solid_node_commands());
  table.add(task_commands());
  table.add(trajectory_commands());
  table.add(transform_commands());
  table.add(path_check_commands());
  table.add(view_commands());
  table.add(workspace_commands());
  table.add(world_commands());
  table.add(world_load_commands());
  table.add(world_name_commands());
  table.add(world_run_commands());
  table.add(world_task_commands());
}

}  // namespace robomosp::ioci
