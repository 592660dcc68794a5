/* SPDX-License-Identifier: Apache-2.0 */
/* The client in C under sanitizers: c_client_test fuzz SECONDS | rpc PROGRAM |
 * connect ADDRESS [TOKEN [CERTIFICATE]]. */
#include "../../sdk/clients/c/robomosp_client.c"

#define NEED(x) \
  do { \
    if (!(x)) { \
      fprintf(stderr, "line %d: %s; last message: %s\n", __LINE__, #x, c ? c->message : ""); \
      return 1; \
    } \
  } while (0)

/* Looks at whatever a line gave. */
static void look(rmpc_client *c) {
  static const char *const paths[] = {"", "q", "[0]", "[1][0]", "a.b", "['x.y'].z", "$array", "q[", ".", "[99999999999]", "a..b"};
  double x[64];
  unsigned char bytes[64];
  size_t i, rows, columns;
  long long n;
  int flag;
  const char *text;
  rmpc_handle h;
  for (i = 0; i < sizeof paths / sizeof *paths; ++i) {
    const char *p = paths[i];
    rmpc_type_of(c, p), rmpc_count(c, p), rmpc_get_number(c, p, x), rmpc_get_integer(c, p, &n);
    rmpc_get_flag(c, p, &flag), rmpc_get_key(c, p, 0, &text), rmpc_get_shape(c, p, &rows, &columns);
    rmpc_get_numbers(c, p, x, 64, &rows), rmpc_get_handle(c, p, &h), rmpc_get_bytes(c, p, bytes, 64, &rows);
    if (!rmpc_get_text(c, p, &text) && strlen(text) > 1u << 20) abort();
  }
}

static int fuzz(double seconds) {
  static const char *const seeds[] = {
      "{\"jsonrpc\":\"2.0\",\"id\":1,\"result\":{\"q\":{\"$array\":{\"shape\":[2,3],\"base64\":\"AAAAAAAA8D8AAAAAAAAAQAAAAAAAAAhAAAAAAAAAEEAAAAAAAAAUQAAAAAAAABhA\"}},\"a\":{\"b\":[1,-2.5e3,\"inf\"]}}}",
      "{\"id\":1,\"result\":[[1,2],[3,4],[\"nan\",1e999]],\"x\":\"\\ud83d\\ude00\\u0000\\n\\u00e9 \xc3\xa9\"}",
      "{\"id\":1,\"error\":{\"code\":-32602,\"message\":\"no\",\"data\":{\"code\":\"io\",\"where\":\"w\",\"hint\":\"h\"}}}",
      "{\"method\":\"event\",\"params\":{\"subscription\":1,\"topic\":\"change\",\"q\":[true,false,null]}}",
      "{\"method\":\"server.closing\",\"params\":{\"reason\":\"The end.\"}}",
      "{\"id\":1,\"result\":{\"$handle\":{\"kind\":\"robot\",\"number\":17,\"name\":\"pa10\"}}}", "[[[[[[[[[[1]]]]]]]]]]"};
  static const char pool[] = "{}[]\":,0123456789eE+-.\\u\xff\xc3\xed\xa0\x80\xf4 \t\n\x01truefalsnd$ay";
  const double until = now() + seconds;
  unsigned long long state = 0x9E3779B97F4A7C15ull, rounds = 0;
  rmpc_client *c = rmpc_new();
  NEED(c);
  printf("seed %llx\n", state);
  while (now() < until) {
    char line[1024];
    size_t length, k, changes;
    int is_answer = 0;
    const char *seed;
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    seed = seeds[state % (sizeof seeds / sizeof *seeds)];
    length = strlen(seed);
    memcpy(line, seed, length);
    changes = state >> 8 & 7;
    for (k = 0; k < changes; ++k) {
      state ^= state << 13, state ^= state >> 7, state ^= state << 17;
      if ((state & 15) == 0) length = (size_t)(state >> 20) % (length + 1);
      else if ((state & 15) == 1 && length > 0 && length < 500) memcpy(line + length, line, length), length *= 2;
      else if (length > 0) line[(state >> 24) % length] = pool[(state >> 40) % (sizeof pool - 1)];
    }
    { /* a block of its own size, so that one byte too far is seen */
      char *copy = malloc(length + 1);
      NEED(copy);
      memcpy(copy, line, length);
      copy[length] = '\n';
      take_line(c, copy, length, 1, &is_answer);
      look(c);
      c->node_count = 0;
      c->root = NONE;
      free(copy);
    }
    while (rmpc_poll_event(c, 0) == RMPC_OK) look(c);
    ++rounds;
  }
  printf("%llu lines\n", rounds);
  rmpc_free(c);
  return rounds < 100;
}

/* Answers of fixed bytes over a socket pair. */
static rmpc_status told(rmpc_client *c, const char *bytes, size_t length) {
  int ends[2];
  rmpc_status status;
  if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends)) return RMPC_OK;
  if (send(ends[1], bytes, length, 0) != (ssize_t)length) return RMPC_OK;
  shutdown(ends[1], SHUT_WR);
  status = rmpc_open(c, ends[0], 1, NULL);
  close(ends[1]);
  rmpc_close(c);
  return status;
}

static int hostile(void) {
  static const char deep[] = "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[\n";
  static const struct {
    const char *bytes, *says;
    rmpc_status status;
  } cases[] = {{"HTTP/1.1 400 Bad Request\r\n\r\n", "not a ROBOMOSP server: it answered \"HTTP", RMPC_PROTOCOL},
               {"220 mail", "not a ROBOMOSP server: it answered \"220 mail", RMPC_PROTOCOL},
               {"", "without an answer", RMPC_LOST},
               {"17\n", "no answer", RMPC_PROTOCOL},
               {"{\"id\":1}\n", "no answer", RMPC_PROTOCOL},
               {"{\"id\":1,\"result\":{}}\n", "not a ROBOMOSP", RMPC_PROTOCOL},
               {"{\"id\":1,\"result\":{\"program\":\"robomosp\",\"protocol\":2}}\n", "version 2", RMPC_PROTOCOL},
               {"{\"id\":1,\"result\":\"\xff\"}\n", "not a ROBOMOSP", RMPC_PROTOCOL},
               {"{\"id\":7,\"result\":1}\n{\"id\":1,\"resu", "in the middle", RMPC_LOST},
               {"{\"method\":\"server.closing\",\"params\":{\"reason\":\"Night.\"}}\n", "Night.", RMPC_LOST},
               {"{\"id\":1,\"error\":{\"code\":-32000,\"message\":\"Ask.\",\"data\":{\"code\":\"permission\"}}}\n", "Ask.", RMPC_REFUSED},
               {deep, "nested too deeply", RMPC_PROTOCOL}};
  size_t i;
  for (i = 0; i < sizeof cases / sizeof *cases; ++i) {
    rmpc_client *c = rmpc_new();
    NEED(c);
    NEED(told(c, cases[i].bytes, strlen(cases[i].bytes)) == cases[i].status);
    if (!strstr(rmpc_message(c), cases[i].says)) {
      fprintf(stderr, "%s\n", rmpc_message(c));
      return 1;
    }
    rmpc_free(c);
  }
  return 0;
}

/* What a program that answers must do; also piece by piece, long arrays, faults, jobs. */
static int work(rmpc_client *c) {
  rmpc_handle arm, two, job;
  double q[7], rows[200], back[600];
  size_t count, n, columns;
  const char *text;
  NEED(!rmpc_callf(c, "robot.get", "{'name': %s}", "pa10") && !rmpc_get_handle(c, "", &arm));
  NEED(strcmp(arm.kind, "robot") == 0 && strcmp(arm.name, "pa10") == 0);
  NEED(!rmpc_callf(c, "robot.solve_ik", "{'id': %h, 'target': [0.557, 0, %g, '180 deg', %d, '180 deg']}", &arm, 0.374, 0));
  NEED(!rmpc_get_text(c, "status", &text) && strcmp(text, "solved") == 0);
  NEED(!rmpc_get_numbers(c, "q", q, 7, &count) && count == 7);
  NEED(rmpc_get_numbers(c, "q", q, 3, &n) == RMPC_USAGE && n == 7);
  NEED(rmpc_get_numbers(c, "none", q, 3, &n) == RMPC_MISSING);
  rmpc_begin(c, "robot.fk");
  rmpc_put_handle(c, "id", &arm);
  rmpc_put_numbers(c, "q", q, count);
  NEED(!rmpc_send(c) && !rmpc_get_numbers(c, "position", back, 3, &n));
  NEED(fabs(back[0] - 0.557) < 1e-9 && fabs(back[2] - 0.374) < 1e-9);
  NEED(!rmpc_get_shape(c, "pose", &n, &columns) && n == 4 && columns == 4);
  NEED(!rmpc_callf(c, "robot.get", "{'name': 'twolink'}") && !rmpc_get_handle(c, "", &two));
  for (n = 0; n < 200; ++n) rows[n] = 0.01 * (double)n;
  NEED(!rmpc_callf(c, "robot.fk", "{'id': %h, 'q': %m}", &two, rows, (size_t)100, (size_t)2));
  NEED(!rmpc_get_numbers(c, "position", back, 600, &n) && n == 300);
  NEED(!rmpc_callf(c, "robot.fk", "{'id': %h, 'q': %v}", &two, rows + 42, (size_t)2));
  NEED(!rmpc_get_numbers(c, "position", q, 7, &n) && q[0] == back[63] && q[1] == back[64]);
  NEED(rmpc_callf(c, "robot.fk", "{'id': 'pa10', 'q': [1]}") == RMPC_REFUSED);
  NEED(strcmp(rmpc_code(c), "invalid_argument") == 0 && rmpc_hint(c)[0] && strstr(rmpc_where(c), "q"));
  NEED(rmpc_call(c, "robot.fk", "{not json") == RMPC_REFUSED);
  NEED(rmpc_callf(c, "robot.fk", "{'id': %s}", "\xff") == RMPC_USAGE);
  NEED(rmpc_callf(c, "robot.fk", "%q") == RMPC_USAGE);
  NEED(!rmpc_call(c, "robot.joints", "{\"id\":\n\"pa10\"}") && rmpc_count(c, "") == 7);
  NEED(!rmpc_get_text(c, "[6].name", &text));
  rmpc_begin(c, "robot.workspace");
  rmpc_put_handle(c, "id", &two);
  rmpc_put_integer(c, "samples", 2000);
  rmpc_as_job(c);
  NEED(!rmpc_send(c) && !rmpc_get_handle(c, "", &job) && strcmp(job.kind, "job") == 0);
  NEED(!rmpc_callf(c, "job.wait", "{'id': %h}", &job) && rmpc_type_of(c, "recording") == RMPC_TABLE);
  NEED(!rmpc_poll_event(c, 5) && strcmp(rmpc_event_name(c), "job.progress") == 0);
  NEED(!rmpc_get_text(c, "state", &text));
  rmpc_set_timeout(c, 0.2);
  NEED(rmpc_callf(c, "robot.workspace", "{'id': %h, 'samples': 10000000, 'collisions': true}", &arm) == RMPC_TIMEOUT);
  rmpc_set_timeout(c, 60);
  NEED(!rmpc_callf(c, "robot.dof", "{'id': %h}", &arm) && !rmpc_get_number(c, "", q) && q[0] == 7);
  {
    static const volatile sig_atomic_t stop = 1;
    rmpc_set_stop(c, &stop);
    NEED(rmpc_callf(c, "robot.workspace", "{'id': %h, 'samples': 10000000, 'collisions': true}", &arm) == RMPC_STOPPED);
    rmpc_set_stop(c, NULL);
    NEED(!rmpc_callf(c, "robot.dof", "{'id': %h}", &arm));
  }
  return 0;
}

int main(int argc, char **argv) {
  rmpc_client *c = NULL;
  int result;
  if (argc < 3) return 2;
  if (strcmp(argv[1], "fuzz") == 0) return hostile() || fuzz(atof(argv[2]));
  c = rmpc_new();
  NEED(c);
  NEED(rmpc_call(c, "version", NULL) == RMPC_LOST);
  NEED(rmpc_connect(c, "unix:/nowhere/at/all", NULL) == RMPC_LOST && strstr(rmpc_message(c), "cannot be reached"));
  NEED(rmpc_connect(c, "127.0.0.1:99999", NULL) == RMPC_USAGE && rmpc_connect(c, "[::1", NULL) == RMPC_USAGE);
  NEED(rmpc_start(c, "/no/such/program") == RMPC_LOST && strstr(rmpc_message(c), "cannot be started"));
#ifndef ROBOMOSP_TLS
  NEED(rmpc_set_tls(c, "") == RMPC_USAGE && strstr(rmpc_message(c), "-DROBOMOSP_TLS") && !rmpc_set_tls(c, NULL));
#else
  NEED(!rmpc_set_tls(c, "") && rmpc_connect(c, "unix:/nowhere", NULL) == RMPC_USAGE);
  NEED(!rmpc_set_tls(c, argc > 4 ? argv[4] : NULL));
#endif
  if (strcmp(argv[1], "rpc") == 0) NEED(!rmpc_start(c, argv[2]));
  else NEED(!rmpc_connect(c, argv[2], argc > 3 ? argv[3] : NULL));
  result = work(c);
  rmpc_free(c);
  return result;
}
