/* The first-order servo of servo.py as a worker of stretch, in C99 without a library. The protocol: book/src/reference/worker.md.
 *
 *   cc -O2 -ffp-contract=off -o servo servo.c
 *
 * It reads only the numbers that it needs from each header, in the order in which the program writes them. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_TRIALS = 4096 };

static char *text;   /* header of the last frame, with a 0 at its end */
static double *body; /* numbers of the last frame */
static double dt_s, *command;
static size_t samples_of[MOST_TRIALS], trials;

static void must(int is_good, const char *why)
{
    if (!is_good) {
        fprintf(stderr, "servo: %s\n", why);
        exit(1);
    }
}

/* The machine must be little-endian, as nearly all are, because the bytes of numbers are copied unchanged. */
static void receive(void)
{
    unsigned char prefix[16];
    uint32_t header;
    uint64_t bytes;
    if (fread(prefix, 1, 16, stdin) != 16)
        exit(0); /* the program has closed the pipe */
    memcpy(&header, prefix + 4, 4);
    memcpy(&bytes, prefix + 8, 8);
    text = realloc(text, (size_t)header + 1);
    body = realloc(body, (size_t)bytes + 8);
    must(text && body, "no memory");
    must(fread(text, 1, header, stdin) == header, "half a header");
    must(fread(body, 1, bytes, stdin) == bytes, "half a body");
    text[header] = 0;
}

static void send(const char *header, const double *numbers, size_t count)
{
    unsigned char prefix[16] = "STR1";
    uint32_t length = (uint32_t)strlen(header);
    uint64_t bytes = 8 * (uint64_t)count;
    memcpy(prefix + 4, &length, 4);
    memcpy(prefix + 8, &bytes, 8);
    fwrite(prefix, 1, 16, stdout);
    fwrite(header, 1, length, stdout);
    fwrite(numbers, 8, count, stdout);
    fflush(stdout);
}

/* Returns the position after the next `key` from `at` on; 0 if there is none. */
static const char *behind(const char *at, const char *key)
{
    at = at ? strstr(at, key) : 0;
    return at ? at + strlen(key) : 0;
}

/* Returns the number of names in the list after a key. */
static size_t names(const char *key)
{
    const char *at = behind(text, key), *end = at ? strchr(at, ']') : 0;
    size_t quotes = 0;
    for (; at && at < end; at++)
        quotes += *at == '"';
    return quotes / 2;
}

static void session(void)
{
    const char *at = behind(text, "\"dt_s\":");
    size_t all = 0, column = 0;
    must(at != 0, "no dt_s");
    dt_s = strtod(at, 0);
    trials = 0;
    for (at = text; (at = behind(at, "\"samples\":")) && trials < MOST_TRIALS; trials++)
        all += samples_of[trials] = strtoul(at, 0, 10);
    /* Find the column of the first input by its name. */
    const char *input = behind(behind(text, "\"inputs\":["), "\"");
    const char *name = behind(text, "\"columns\":[");
    size_t length = input ? strcspn(input, "\"") : 0;
    for (; (name = behind(name, "\"name\":\"")); column++)
        if (!strncmp(name, input, length) && name[length] == '"')
            break;
    must(name != 0, "the input is no column");
    command = malloc(8 * all + 8);
    must(command != 0, "no memory");
    memcpy(command, body + column * all, 8 * all);
    must(names("\"parameters\":[") == 2 && names("\"effects\":[") == 1, "gain, tau and brake are needed");
    send("{\"kind\":\"ready\"}", 0, 0);
}

/* angle' = (gain u - brake - angle)/tau by Euler steps; each trial starts at rest. */
static size_t servo(const double *p, const double *u, size_t count, double *out)
{
    double gain = p[0], tau = p[1], brake = p[2], step = dt_s / tau;
    size_t i = 0;
    for (size_t t = 0; t < count; t++) {
        double angle = 0.0;
        for (size_t end = i + samples_of[t]; i < end; i++) {
            double push, held;
            out[i] = angle;
            push = gain * u[i] - angle;
            held = push < -brake ? -brake : push;
            held = held > brake ? brake : held;
            angle += step * (push - held);
        }
    }
    return i;
}

static void simulate(void)
{
    const char *at = behind(text, "\"models\":[");
    const double *numbers = body;
    double *out = 0;
    size_t used = 0, room = 64;
    char *header = malloc(room);
    must(header != 0, "no memory");
    strcpy(header, "{\"kind\":\"outputs\",\"models\":[");
    /* The keys of a model are in alphabetical order: inputs, stage, trials. */
    for (int first = 1; (at = behind(at, "\"inputs\":")); first = 0) {
        int is_altered = *at == 't';
        const char *of = behind(at, "\"trials\":");
        size_t count = of ? strtoul(of, 0, 10) : 0, all = 0;
        for (size_t t = 0; t < count; t++)
            all += samples_of[t];
        out = realloc(out, 8 * (used + all) + 8);
        header = realloc(header, room += 64);
        must(out && header, "no memory");
        used += servo(numbers, is_altered ? numbers + 3 : command, count, out + used);
        numbers += 3 + (is_altered ? all : 0);
        sprintf(header + strlen(header), "%s{\"samples\":%lu}", first ? "" : ",", (unsigned long)all);
    }
    strcat(header, "]}");
    send(header, out, used);
    free(header);
    free(out);
}

int main(void)
{
    for (;;) {
        receive();
        if (strstr(text, "\"kind\":\"hello\""))
            send("{\"kind\":\"hello\",\"version\":1,\"batch\":8,\"inputs\":true,"
                 "\"parameters\":[\"gain\",\"tau\"],\"effects\":[\"brake\"]}", 0, 0);
        else if (strstr(text, "\"kind\":\"session\""))
            session();
        else if (strstr(text, "\"kind\":\"simulate\""))
            simulate();
        else
            return 0;
    }
}
