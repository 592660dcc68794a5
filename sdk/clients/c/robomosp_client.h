/* SPDX-License-Identifier: Apache-2.0 */
/* ROBOMOSP from C: a client of `robomosp serve` (TCP, Unix socket) and of `robomosp rpc` (a child process).
 * C99 and POSIX sockets, nothing else: copy robomosp_client.h and robomosp_client.c into your program.
 *
 *   rmpc_client *c = rmpc_new();
 *   rmpc_handle arm;
 *   double q[7];
 *   size_t count;
 *   if (rmpc_connect(c, "127.0.0.1:7007", NULL) ||
 *       rmpc_callf(c, "robot.get", "{'name': %s}", "pa10") || rmpc_get_handle(c, "", &arm) ||
 *       rmpc_callf(c, "robot.solve_ik", "{'id': %h, 'target': [0.557, 0, 0.374, '180 deg', 0, '180 deg']}", &arm) ||
 *       rmpc_get_numbers(c, "q", q, 7, &count))
 *     fprintf(stderr, "%s\n", rmpc_message(c));
 *   rmpc_free(c);
 *
 * Memory. A client owns all that it allocates: itself, the request that is written, the answer that was
 * read last, and events that wait. These buffers grow with what is sent and received, up to the limits
 * below, are used again by the next call, and go with rmpc_free(). Nothing that a function returns is to be
 * freed. Texts that point into an answer hold until the next call or event; handles and numbers are copies.
 *
 * Threads. A client belongs to one thread at a time. No function raises signals, prints, or exits.
 * TLS needs OpenSSL 1.1.1 or later: compile robomosp_client.c with -DROBOMOSP_TLS, link libssl and libcrypto, and
 * call rmpc_set_tls(). Without, use a tunnel for other machines (ssh -L, stunnel). */
#ifndef ROBOMOSP_CLIENT_H
#define ROBOMOSP_CLIENT_H

#include <signal.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RMPC_PROTOCOL_VERSION 1         /* version of the protocol */
#define RMPC_DEEPEST 100           /* levels of an answer */
#define RMPC_LONGEST_ANSWER (128u << 20)    /* bytes */
#define RMPC_MOST_VALUES (4u << 20)         /* of an answer; arrays of numbers count as one */
#define RMPC_LONGEST_REQUEST (8u << 20)     /* bytes, what servers read */
#define RMPC_EVENT_BYTES (1u << 20)         /* of events that wait; the oldest are left out */

typedef struct rmpc_client rmpc_client;

typedef enum rmpc_status {
  RMPC_OK = 0,
  RMPC_REFUSED,   /* the program answered with an error: rmpc_code(), rmpc_where(), rmpc_hint() */
  RMPC_MISSING,   /* the answer has no such field, or one of another type */
  RMPC_TIMEOUT,   /* no answer in time; the request was cancelled */
  RMPC_STOPPED,   /* the flag of rmpc_set_stop() was set; the request was cancelled */
  RMPC_LOST,      /* there is no connection (any more) */
  RMPC_PROTOCOL,  /* the other end does not speak as ROBOMOSP does; the connection is closed */
  RMPC_USAGE,     /* a wrong argument of this library */
  RMPC_MEMORY     /* no memory; the connection is closed */
} rmpc_status;

typedef enum rmpc_type { RMPC_NONE, RMPC_NULL, RMPC_FLAG, RMPC_NUMBER, RMPC_TEXT, RMPC_LIST, RMPC_TABLE } rmpc_type;

/* A record, recording, run or job of the program. A value of its own, to be copied freely. */
typedef struct rmpc_handle {
  char kind[32];
  char name[96]; /* empty where it is longer */
  long long number;
} rmpc_handle;

/* --- connecting --- */

/* A client without connection; NULL when there is no memory. */
rmpc_client *rmpc_new(void);
/* Ends the connection and frees everything; NULL is fine. */
void rmpc_free(rmpc_client *c);
/* What the next rmpc_connect() does: NULL = no TLS, as at first; "" = TLS, with the authorities of the system; else
 * TLS, with a PEM file of certificates: a server that shows one of them is trusted whatever its name, and what they
 * signed by name. RMPC_USAGE where it was compiled without ROBOMOSP_TLS. */
rmpc_status rmpc_set_tls(rmpc_client *c, const char *trusted);
/* Connects to a server: "127.0.0.1:7007", "localhost", "[::1]:7007" or "unix:/path". token: NULL without
 * one. The time of rmpc_set_timeout() holds for the connection, apart from looking up a host's name. */
rmpc_status rmpc_connect(rmpc_client *c, const char *address, const char *token);
/* Starts `program rpc` as a child process in a session of its own; "robomosp" when program is NULL. */
rmpc_status rmpc_start(rmpc_client *c, const char *program);
/* Speaks over a stream socket that is connected, which it owns from then on; is_served: whether to say
 * server.hello (else the program is asked for its version). */
rmpc_status rmpc_open(rmpc_client *c, int fd, int is_served, const char *token);
/* Ends the connection, and a child process. The client can connect again. */
void rmpc_close(rmpc_client *c);
int rmpc_is_open(const rmpc_client *c);
/* The longest wait of a call [s]; 0 = as long as it takes. 30 at first. */
void rmpc_set_timeout(rmpc_client *c, double seconds);
/* A flag that a signal handler sets to end a call; looked at every 50 ms. NULL = none. */
void rmpc_set_stop(rmpc_client *c, const volatile sig_atomic_t *flag);

/* --- what went wrong, of the latest function that failed --- */

const char *rmpc_message(const rmpc_client *c); /* one sentence or more */
const char *rmpc_code(const rmpc_client *c);    /* a word such as invalid_argument, unreachable, io */
const char *rmpc_where(const rmpc_client *c);   /* "robot.fk, q" */
const char *rmpc_hint(const rmpc_client *c);    /* what to do */

/* --- calling --- */

/* Calls a command. params: a JSON object or array as text, or NULL. */
rmpc_status rmpc_call(rmpc_client *c, const char *method, const char *params);
/* The same by a format: JSON in which ' stands for ", and
 *   %s text (const char *)            %d int     %D long long     %g double     %b flag (int)
 *   %v vector (const double *, size_t count)     %m matrix (const double *, size_t rows, size_t columns)
 *   %h handle (const rmpc_handle *)              %j JSON (const char *)          %% a per cent sign */
rmpc_status rmpc_callf(rmpc_client *c, const char *method, const char *format, ...);

/* The same piece by piece, for programs that are generated: begin, put..., send. Faults of the pieces
 * (no memory, texts that are not UTF-8) are told by rmpc_send(). */
void rmpc_begin(rmpc_client *c, const char *method);
void rmpc_put_text(rmpc_client *c, const char *name, const char *text);
void rmpc_put_number(rmpc_client *c, const char *name, double x);
void rmpc_put_integer(rmpc_client *c, const char *name, long long i);
void rmpc_put_flag(rmpc_client *c, const char *name, int flag);
void rmpc_put_numbers(rmpc_client *c, const char *name, const double *x, size_t count);
void rmpc_put_matrix(rmpc_client *c, const char *name, const double *rows_first, size_t rows, size_t columns);
void rmpc_put_handle(rmpc_client *c, const char *name, const rmpc_handle *h);
void rmpc_put_json(rmpc_client *c, const char *name, const char *json);
/* The command becomes a job: the answer is its handle, "job.wait" {"id": job} gives its result. */
void rmpc_as_job(rmpc_client *c);
rmpc_status rmpc_send(rmpc_client *c);

/* --- reading the latest answer or event --- */

/* Paths: "q", "joints[2].name", "[0]", "" for the whole. Indices count from 0. Keys with . or [ are
 * written in quotes: "parameters['bore.radius']". */
rmpc_type rmpc_type_of(const rmpc_client *c, const char *path);
/* Entries of a list or table, numbers of a vector, rows of a matrix; 0 of all else. */
size_t rmpc_count(const rmpc_client *c, const char *path);
rmpc_status rmpc_get_number(rmpc_client *c, const char *path, double *out); /* "inf", "-inf", "nan" too */
rmpc_status rmpc_get_integer(rmpc_client *c, const char *path, long long *out);
rmpc_status rmpc_get_flag(rmpc_client *c, const char *path, int *out);
/* UTF-8 that ends with 0, borrowed until the next call or event. */
rmpc_status rmpc_get_text(rmpc_client *c, const char *path, const char **out);
/* The key of entry i of a table, borrowed. */
rmpc_status rmpc_get_key(rmpc_client *c, const char *path, size_t i, const char **out);
/* A vector, or a matrix row after row, into `out`, which has room for `most`; *count is how many there
 * are. RMPC_USAGE when that is more than `most`: nothing is written then, and *count is right. */
rmpc_status rmpc_get_numbers(rmpc_client *c, const char *path, double *out, size_t most, size_t *count);
/* Rows and columns of a matrix; a vector has one column. */
rmpc_status rmpc_get_shape(rmpc_client *c, const char *path, size_t *rows, size_t *columns);
rmpc_status rmpc_get_handle(rmpc_client *c, const char *path, rmpc_handle *out);
/* The bytes of a text in base64, such as the png of a picture; as rmpc_get_numbers. */
rmpc_status rmpc_get_bytes(rmpc_client *c, const char *path, unsigned char *out, size_t most, size_t *count);

/* --- events --- */

/* Subscribes on a server; topics: "change", "message", "job", "run" and "recording" separated by blanks, NULL = all. */
rmpc_status rmpc_subscribe(rmpc_client *c, const char *topics, long long *subscription);
/* Waits up to `seconds` (0 = not at all) for what the program says unasked. RMPC_OK: the functions above
 * read it, and rmpc_event_name() is "event" or "job.progress". RMPC_TIMEOUT: there was nothing. */
rmpc_status rmpc_poll_event(rmpc_client *c, double seconds);
const char *rmpc_event_name(const rmpc_client *c);
/* Events that were left out since the last call of this function, because too many waited. */
size_t rmpc_events_left_out(rmpc_client *c);

#ifdef __cplusplus
}
#endif
#endif
