##
## This file is part of clino. This folder, tools/sigrok, has a licence of its own: it is loaded into libsigrokdecode,
## which is under the GPL.
##
## SPDX-License-Identifier: GPL-3.0-or-later
##

'''
STT ISU inclinometers in binary mode: commands and responses of AN #201, "Interfacing to an ISU Module".

Stack it on UART at 9600 baud. One wire, such as the RO of a transceiver whose receiver is always on, goes to RX; two wires go
to RX and TX. The direction of a message is in its bytes.

A message is its length without length byte and checksum, a byte of address, function and direction, data, checksum: the low
byte of the sum of all bytes between length and checksum.
'''

from .pd import Decoder
