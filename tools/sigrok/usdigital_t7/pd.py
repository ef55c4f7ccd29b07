##
## This file is part of clino. This folder, tools/sigrok, has a licence of its own: it is loaded into libsigrokdecode,
## which is under the GPL.
##
## SPDX-License-Identifier: GPL-3.0-or-later
##

import sigrokdecode as srd

# Annotation classes.
COMMAND, RESPONSE, BYTES, ERROR = range(4)

# Code: name, length byte of the command, length byte of the response (section 2 of the guide).
COMMANDS = {
    0x80: ('get_all_angles', 1, 0x10),
    0x81: ('get_angle', 1, 6),
    0x82: ('get_angle', 1, 6),
    0x83: ('get_angle', 1, 6),
    0x84: ('set_angle', 7, 3),
    0x85: ('get_all_angle_offsets', 1, 0x0E),
    0x86: ('set_angle_offset', 7, 3),
    0x87: ('get_all_data', 1, 0x20),
    0x88: ('get_all_directions', 1, 5),
    0x89: ('set_direction', 4, 3),
    0x8A: ('get_damping', 1, 4),
    0x8B: ('set_damping', 4, 3),
    0x8C: ('get_angle_output_range', 1, 3),
    0x8D: ('set_angle_output_range', 3, 3),
    0x8E: ('get_device_information', 1, 0x14),
    0x8F: ('set_baud_rate', 3, 3),
    0x91: ('set_address', 8, 3),
}

# The example of section 2.1.1 has this length byte in front of the same 18 bytes; its table has 0x10.
PRINTED_ALL_ANGLES_LENGTH = 0x0A

# Length byte of a response that is a status and nothing else.
STATUS_LENGTH = 3

STATUS = {
    0: 'success',
    1: 'invalid_command',
    3: 'invalid_parameter',
    4: 'checksum_error',
    5: 'command_failed',
    7: 'flash_erase_error',
    8: 'flash_program_error',
    9: 'address_out_of_range',
}

RANGES = ('bidirectional', 'unidirectional')
DIRECTIONS = ('normal', 'reversed')
BAUD_RATES = (115200, 57600, 38400, 19200, 9600)

# A pause of this many characters within a frame ends it.
LONGEST_PAUSE = 4

TX = 1


def number(data):
    return int.from_bytes(bytes(data), 'big', signed=True)


def degrees(data):
    '''Four bytes in 0.001 degrees.'''
    value = number(data)
    return '%s%d.%03d' % ('-' if value < 0 else '', abs(value) // 1000, abs(value) % 1000)


def choice(names, value):
    return names[value] if value < len(names) else 'unknown_%d' % value


def text(data):
    return bytes(data).decode('ascii', 'replace').strip()


class Decoder(srd.Decoder):
    api_version = 3
    id = 'usdigital_t7'
    name = 'T7'
    longname = 'US Digital T7 inclinometer'
    desc = 'Commands and responses of US Digital T7 inclinometers.'
    license = 'gplv3+'
    inputs = ['uart']
    outputs = []
    tags = ['Sensor']
    annotations = (
        ('command', 'Command'),
        ('response', 'Response'),
        ('bytes', 'Bytes of a frame'),
        ('error', 'Error'),
    )
    annotation_rows = (
        ('frames', 'Frames', (COMMAND, RESPONSE)),
        ('hex', 'Bytes', (BYTES,)),
        ('errors', 'Errors', (ERROR,)),
    )

    def __init__(self):
        self.reset()

    def reset(self):
        # By wire: the frame so far, as (start, end, byte), and what is wrong with one of its characters.
        self.frames = [[], []]
        self.spoilt = [None, None]
        # Address and code of the command that waits for its response.
        self.asked = None

    def start(self):
        self.out_ann = self.register(srd.OUTPUT_ANN)

    def decode(self, ss, es, data):
        kind, wire, value = data
        if kind == 'FRAME':
            byte, valid = value
            self.character(ss, es, wire, byte, valid)

    def character(self, ss, es, wire, byte, valid):
        frame = self.frames[wire]
        if frame and ss - frame[-1][1] > LONGEST_PAUSE * (es - ss):
            self.give_up(wire, 'incomplete')
            frame = self.frames[wire]
        frame.append((ss, es, byte & 0xFF))
        if not valid:
            self.spoilt[wire] = 'framing error'
        expected = self.expected([byte for _, _, byte in frame])
        if expected is None:
            return
        if len(frame) >= expected:
            self.complete(wire)

    def expected(self, data):
        '''How many bytes the frame has, once that is known.'''
        if len(data) < 3:
            return None
        # Commands that read have no checksum; the printed length byte is one of 18 bytes, too.
        if data[1] == 1:
            return 3
        if data[1] == PRINTED_ALL_ANGLES_LENGTH and data[2] == 0x80:
            return 18
        return data[1] + 2 if data[1] >= 2 else 3

    def complete(self, wire):
        frame = self.frames[wire]
        data = [byte for _, _, byte in frame]
        if self.spoilt[wire]:
            return self.give_up(wire, self.spoilt[wire])
        if data[1] == 0:
            return self.give_up(wire, 'length 0')
        if data[1] > 1 and sum(data) & 0xFF:
            computed = -sum(data[:-1]) & 0xFF
            return self.give_up(wire, 'checksum %02x, computed %02x' % (data[-1], computed))
        ss, es = frame[0][0], frame[-1][1]
        self.frames[wire] = []
        self.put_bytes(ss, es, data)
        address, length, code = data[:3]
        payload = data[3:-1]
        if code not in COMMANDS:
            self.put(ss, es, self.out_ann, [ERROR, ['unknown code %02x' % code]])
            return
        name = COMMANDS[code][0]
        if self.is_command(wire, address, length, code):
            self.asked = (address, code)
            words = self.command(code, payload)
            kind, head = COMMAND, 'command %d %s' % (address, name)
        elif self.is_response(length, code):
            self.asked = None
            words = self.response(code, length, payload)
            kind, head = RESPONSE, 'response %d %s' % (address, name)
        else:
            self.put(ss, es, self.out_ann, [ERROR, ['length %d does not fit %s' % (length, name)]])
            return
        whole = head + (': ' + words if words else '')
        self.put(ss, es, self.out_ann, [kind, [whole, words or head, '%d' % address]])

    def is_command(self, wire, address, length, code):
        if length != COMMANDS[code][1]:
            return False
        # On one wire, a frame that may be either is a response if it is what was asked for.
        return wire == TX or not self.is_response(length, code) or self.asked != (address, code)

    def is_response(self, length, code):
        printed = code == 0x80 and length == PRINTED_ALL_ANGLES_LENGTH
        return printed or length in (COMMANDS[code][2], STATUS_LENGTH)

    def command(self, code, data):
        if code in (0x81, 0x82, 0x83):
            return 'axis %d' % (code - 0x81)
        if code in (0x84, 0x86):
            return 'axis %d, angle %s deg' % (data[0], degrees(data[1:5]))
        if code == 0x89:
            return 'axis %d, %s' % (data[0], choice(DIRECTIONS, data[1]))
        if code == 0x8B:
            return 'damping %d ms' % (data[0] << 8 | data[1])
        if code == 0x8D:
            return choice(RANGES, data[0])
        if code == 0x8F:
            return 'baud %s' % choice(BAUD_RATES, data[0])
        if code == 0x91:
            return 'type %d, serial %d, new address %d' % (data[0], number([0] + data[1:5]), data[5])
        return ''

    def response(self, code, length, data):
        if length == STATUS_LENGTH and code != 0x8C:
            return 'status %s' % STATUS.get(data[0], 'unknown_%d' % data[0])
        triple = lambda data: ' '.join(degrees(data[at:at + 4]) for at in (0, 4, 8))
        if code == 0x80:
            return 'angles %s deg, temperature %.2f C' % (triple(data), number(data[12:14]) / 100)
        if code in (0x81, 0x82, 0x83):
            return 'axis %d, angle %s deg' % (code - 0x81, degrees(data))
        if code == 0x85:
            return 'offsets %s deg' % triple(data)
        if code == 0x87:
            accelerations = ' '.join(str(number(data[at:at + 4])) for at in (14, 18, 22))
            temperature, serial = number(data[12:14]) / 100, number([0] + data[26:30])
            return 'angles %s deg, temperature %.2f C, accelerations %s, serial %d' % (
                triple(data), temperature, accelerations, serial)
        if code == 0x88:
            return 'directions %s' % ' '.join(choice(DIRECTIONS, value) for value in data)
        if code == 0x8A:
            return 'damping %d ms' % (data[0] << 8 | data[1])
        if code == 0x8C:
            return choice(RANGES, data[0])
        return 'serial %d, firmware %s, product %s, calibration %d' % (
            number([0] + data[0:4]), text(data[4:10]), text(data[10:16]), number(data[16:18]))

    def put_bytes(self, ss, es, data):
        self.put(ss, es, self.out_ann, [BYTES, [' '.join('%02x' % byte for byte in data)]])

    def give_up(self, wire, why):
        frame = self.frames[wire]
        ss, es = frame[0][0], frame[-1][1]
        data = [byte for _, _, byte in frame]
        self.frames[wire], self.spoilt[wire] = [], None
        self.put_bytes(ss, es, data)
        self.put(ss, es, self.out_ann, [ERROR, [why]])
