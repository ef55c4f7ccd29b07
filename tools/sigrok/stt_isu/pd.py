##
## This file is part of clino. This folder, tools/sigrok, has a licence of its own: it is loaded into libsigrokdecode,
## which is under the GPL.
##
## SPDX-License-Identifier: GPL-3.0-or-later
##

import sigrokdecode as srd

# Annotation classes.
COMMAND, RESPONSE, BYTES, ERROR = range(4)

# By function code (section 4 of AN #201).
FUNCTIONS = (
    'go_to_soft_error',
    'reset_module',
    'read_ram',
    'write_ram',
    'read_eeprom',
    'write_eeprom',
    'reset_null_position',
)

# Errors of the module have the address 15, which no module has, and are alone in that.
INVALID_FUNCTION = [0x01, 0xFF, 0xFF]
INVALID_CHECKSUM = [0x01, 0xFD, 0xFD]
HARD_ERROR = 0xF1

# RAM address of the current angle: 16 bits, a turn is 65536.
CURRENT_ANGLE = 0x58

# A pause of this many characters within a message ends it.
LONGEST_PAUSE = 10


class Decoder(srd.Decoder):
    api_version = 3
    id = 'stt_isu'
    name = 'ISU'
    longname = 'STT ISU inclinometer'
    desc = 'Commands and responses of STT ISU inclinometers in binary mode.'
    license = 'gplv3+'
    inputs = ['uart']
    outputs = []
    tags = ['Sensor']
    annotations = (
        ('command', 'Command'),
        ('response', 'Response'),
        ('bytes', 'Bytes of a message'),
        ('error', 'Error'),
    )
    annotation_rows = (
        ('messages', 'Messages', (COMMAND, RESPONSE)),
        ('hex', 'Bytes', (BYTES,)),
        ('errors', 'Errors', (ERROR,)),
    )

    def __init__(self):
        self.reset()

    def reset(self):
        # By wire: the message so far, as (start, end, byte), and whether one of its characters is spoilt.
        self.messages = [[], []]
        self.spoilt = [False, False]

    def start(self):
        self.out_ann = self.register(srd.OUTPUT_ANN)

    def decode(self, ss, es, data):
        kind, wire, value = data
        if kind == 'FRAME':
            byte, valid = value
            self.character(ss, es, wire, byte, valid)

    def character(self, ss, es, wire, byte, valid):
        message = self.messages[wire]
        if message and ss - message[-1][1] > LONGEST_PAUSE * (es - ss):
            self.give_up(wire, 'incomplete')
            message = self.messages[wire]
        message.append((ss, es, byte & 0xFF))
        self.spoilt[wire] |= not valid
        if len(message) == message[0][2] + 2:
            self.complete(wire)

    def complete(self, wire):
        message = self.messages[wire]
        data = [byte for _, _, byte in message]
        if self.spoilt[wire]:
            return self.give_up(wire, 'framing error')
        if data[0] == 0:
            return self.give_up(wire, 'length 0')
        computed = sum(data[1:-1]) & 0xFF
        if data[-1] != computed:
            return self.give_up(wire, 'checksum %02x, computed %02x' % (data[-1], computed))
        ss, es = message[0][0], message[-1][1]
        self.messages[wire] = []
        self.put_bytes(ss, es, data)
        head, payload = data[1], data[2:-1]
        address, function, is_response = head >> 4, head >> 1 & 7, head & 1
        error = self.module_error(data)
        if error:
            self.put(ss, es, self.out_ann, [RESPONSE, ['response error: ' + error, error]])
            return
        if function >= len(FUNCTIONS):
            self.put(ss, es, self.out_ann, [ERROR, ['unknown function %d' % function]])
            return
        name = FUNCTIONS[function]
        words = (self.response if is_response else self.command)(name, payload)
        if words is None:
            self.put(ss, es, self.out_ann, [ERROR, ['length %d does not fit %s' % (data[0], name)]])
            return
        kind, what = (RESPONSE, 'response') if is_response else (COMMAND, 'command')
        start = '%s %d %s' % (what, address, name)
        whole = start + (': ' + words if words else '')
        self.put(ss, es, self.out_ann, [kind, [whole, words or start, '%d' % address]])

    def module_error(self, data):
        if data == INVALID_FUNCTION:
            return 'invalid_function_code'
        if data == INVALID_CHECKSUM:
            return 'invalid_checksum'
        if data[:2] == [2, HARD_ERROR]:
            return 'hardware_error, command %02x' % data[2]
        return None

    def command(self, name, data):
        '''What it says; None for a length that it cannot have.'''
        if name in ('read_ram', 'read_eeprom'):
            return '%02x, %d' % tuple(data) if len(data) == 2 else None
        if name in ('write_ram', 'write_eeprom'):
            return '%02x, %s' % (data[0], self.hex(data[1:])) if len(data) > 1 else None
        return '' if not data else None

    def response(self, name, data):
        if name == 'read_ram' and len(data) == 3 and data[0] == CURRENT_ANGLE:
            # A code is 360 / 65536 degrees; five decimals tell neighbours apart.
            code = data[1] << 8 | data[2]
            return 'angle %.5f deg' % (code * 360 / 65536)
        if name in ('read_ram', 'read_eeprom'):
            return '%02x, %s' % (data[0], self.hex(data[1:])) if len(data) > 1 else None
        if name in ('write_ram', 'write_eeprom'):
            # Write RAM: the count, or the first byte written; the document has both.
            return '%02x, %d' % tuple(data) if len(data) == 2 else None
        return '' if not data else None

    def hex(self, data):
        return ' '.join('%02x' % byte for byte in data)

    def put_bytes(self, ss, es, data):
        self.put(ss, es, self.out_ann, [BYTES, [self.hex(data)]])

    def give_up(self, wire, why):
        message = self.messages[wire]
        ss, es = message[0][0], message[-1][1]
        data = [byte for _, _, byte in message]
        self.messages[wire], self.spoilt[wire] = [], False
        self.put_bytes(ss, es, data)
        self.put(ss, es, self.out_ann, [ERROR, [why]])
