##
## This file is part of clino. This folder, tools/sigrok, has a licence of its own: it is loaded into libsigrokdecode,
## which is under the GPL.
##
## SPDX-License-Identifier: GPL-3.0-or-later
##

'''
US Digital T7 inclinometers (T7-1, T7-3) on an RS485 pair: commands and responses of the T7 Communication User Guide 1.7.

Stack it on UART. One wire, such as the RO of a transceiver whose receiver is always on, goes to RX; with two wires, the
gateway's TX and RX, the gateway's TX goes to TX: what is on it is a command.

A frame is address, length of what follows but the checksum, command code, data, checksum: the two's complement of the sum of
all bytes before it. Commands that read have no checksum.
'''

from .pd import Decoder
