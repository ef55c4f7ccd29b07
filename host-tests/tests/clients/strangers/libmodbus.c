/* Reads a gateway with libmodbus, and sets up a slot. Arguments and output: strangers.rs.
 *
 * libmodbus 3.1 has no functions 08 and 43: their answers are read from its port as they come. */
#include <errno.h>
#include <modbus.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#define SLOTS 6

static modbus_t *master;

static void check(int done, const char *what) {
    if (done < 0) {
        fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
        exit(1);
    }
}

static void read_words(int address, int count, uint16_t *words) {
    check(modbus_read_registers(master, address, count, words), "read");
}

static int32_t signed_at(const uint16_t *words) { return (int32_t)((uint32_t)words[0] << 16 | words[1]); }

/* An answer to a function that libmodbus does not know, without its checksum; its length. */
static int raw(const uint8_t *request, int length, uint8_t *answer) {
    struct pollfd port = {.fd = modbus_get_socket(master), .events = POLLIN};
    int got = 0;
    check(modbus_send_raw_request(master, request, length), "send");
    for (int wait = 60000; poll(&port, 1, wait) > 0; wait = 1000) {
        int more = (int)read(port.fd, answer + got, 256 - (size_t)got);
        if (more <= 0) break;
        got += more;
    }
    if (got < 5) {
        fprintf(stderr, "no answer to function %d\n", request[1]);
        exit(1);
    }
    return got - 2;
}

int main(int count, char **arguments) {
    int angles, ages, floats, cdab, counter, settings, spare;
    uint16_t words[2 * SLOTS];
    uint8_t answer[256];
    if (count != 9) return 2;
    angles = atoi(arguments[2]), ages = atoi(arguments[3]), floats = atoi(arguments[4]), cdab = atoi(arguments[5]);
    counter = atoi(arguments[6]), settings = atoi(arguments[7]), spare = atoi(arguments[8]);
    master = modbus_new_rtu(arguments[1], 19200, 'N', 8, 1);
    check(modbus_set_slave(master, 1), "address");
    check(modbus_connect(master), "connect");
    check(modbus_set_response_timeout(master, 60, 0), "timeout");
    check(modbus_set_byte_timeout(master, 60, 0), "timeout");

    for (int tries = 0, right = 0; right < SLOTS && tries < 300; tries++) {
        read_words(angles, 2 * SLOTS, words);
        for (right = 0; right < SLOTS && signed_at(words + 2 * right) != INT32_MIN;) right++;
    }
    printf("angles");
    for (int slot = 0; slot < SLOTS; slot++) printf(" %d", (int)signed_at(words + 2 * slot));
    read_words(ages, SLOTS, words);
    printf("\nages");
    for (int slot = 0; slot < SLOTS; slot++) printf(" %u", (unsigned)words[slot]);
    read_words(floats, 2 * SLOTS, words);
    printf("\nfloats");
    for (int slot = 0; slot < SLOTS; slot++) printf(" %f", (double)modbus_get_float_abcd(words + 2 * slot));
    read_words(cdab, 2 * SLOTS, words);
    printf("\ncdab");
    for (int slot = 0; slot < SLOTS; slot++) printf(" %f", (double)modbus_get_float_cdab(words + 2 * slot));
    read_words(counter, 2, words);
    printf("\ncounter %u\n", (unsigned)signed_at(words));

    int length = raw((const uint8_t[]){1, 43, 14, 2, 0}, 5, answer);
    for (int object = 0, at = 8; object < answer[7] && at + 2 <= length; object++) {
        printf("object %d %.*s\n", answer[at], answer[at + 1], (const char *)answer + at + 2);
        at += 2 + answer[at + 1];
    }
    raw((const uint8_t[]){1, 8, 0, 11, 0, 0}, 6, answer);
    printf("messages %d\n", answer[4] << 8 | answer[5]);

    /* Enabled, a T7, at the spare address; then by one register that it is off. */
    const uint16_t slot[3] = {1, 1, (uint16_t)spare};
    check(modbus_write_registers(master, settings, 3, slot), "write");
    for (int tries = 0; tries < 300; tries++) {
        read_words(angles + 2 * SLOTS, 2, words);
        if (signed_at(words) != INT32_MIN) break;
    }
    printf("set_up %d\n", (int)signed_at(words));
    check(modbus_write_register(master, settings, 0), "write");
    modbus_close(master);
    modbus_free(master);
    return 0;
}
