/* SPDX-License-Identifier: Apache-2.0 */
/* The PA-10 solves a pose somewhere else, goes there, and a picture comes back.
 *   pa10_pose [ADDRESS [TOKEN]]      without an address it starts a program of its own */
#include <stdio.h>
#include <stdlib.h>

#include "robomosp_client.h"

int main(int argc, char **argv) {
  rmpc_client *c = rmpc_new();
  rmpc_handle arm, cell;
  double q[7];
  unsigned char *png = NULL;
  size_t count = 0, i;
  FILE *file;
  if (!c) return 2;
  if (argc > 1 ? rmpc_connect(c, argv[1], argc > 2 ? argv[2] : NULL) : rmpc_start(c, getenv("ROBOMOSP_PROGRAM")))
    goto failed;
  if (rmpc_callf(c, "robot.get", "{'name': 'pa10'}") || rmpc_get_handle(c, "", &arm)) goto failed;
  if (rmpc_callf(c, "robot.solve_ik", "{'id': %h, 'target': [0.557, 0, 0.374, '180 deg', 0, '180 deg']}", &arm) ||
      rmpc_get_numbers(c, "q", q, 7, &count))
    goto failed;
  if (rmpc_callf(c, "world.create", "{'name': 'student'}") || rmpc_get_handle(c, "", &cell) ||
      rmpc_callf(c, "world.add_robot", "{'id': %h, 'robot': %h}", &cell, &arm) ||
      rmpc_callf(c, "world.set_robot_q", "{'id': %h, 'robot': 'pa10', 'q': %v}", &cell, q, count) ||
      rmpc_callf(c, "robot.joint_values", "{'id': %h}", &arm) || rmpc_get_numbers(c, "", q, 7, &count))
    goto failed;
  for (i = 0; i < count; ++i) printf("joint %u: %8.4f rad\n", (unsigned)i + 1, q[i]);
  if (rmpc_callf(c, "world.picture", "{'id': %h, 'size': [400, 300], 'quality': 'draft'}", &cell)) {
    printf("no picture: %s\n", rmpc_message(c));
  } else {
    rmpc_get_bytes(c, "png", NULL, 0, &count); /* how many */
    png = malloc(count);
    if (!png || rmpc_get_bytes(c, "png", png, count, &count)) goto failed;
    file = fopen("pa10.png", "wb");
    if (!file || fwrite(png, 1, count, file) != count || fclose(file)) {
      perror("pa10.png");
      return 1;
    }
    printf("pa10.png: %u bytes\n", (unsigned)count);
  }
  free(png);
  rmpc_free(c);
  return 0;
failed:
  fprintf(stderr, "%s\n", rmpc_message(c));
  free(png);
  rmpc_free(c);
  return 1;
}
