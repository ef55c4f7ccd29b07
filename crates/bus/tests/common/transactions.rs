//! Every command of both documents, with what simulated sensors answer.

use clino_bus::{Isu, Protocol, Serial, T7, Timing};
use clino_codec::angle::Range;
use clino_codec::isu::{Data, Words};
use clino_codec::t7::{Axis, BaudRate, DeviceType, Direction, Millidegrees};
use clino_codec::{isu, t7};
use clino_sim::motion::Motion;

use super::{answer_of, expected};

const DEGREE: i64 = 1_000_000;

/// Finds the places where a well-formed answer begins.
type Finder = Box<dyn Fn(&[u8]) -> Vec<usize>>;

/// One kind of transaction.
pub struct Transaction<P: Protocol> {
    pub address: P::Address,
    pub request: P::Request,
    /// The answer, and that of the same node a turn of 75° later.
    pub first: Vec<u8>,
    pub second: Vec<u8>,
    /// Another node's answer to the same command, and the same node's to another one.
    pub other_node: Vec<u8>,
    pub other_command: Vec<u8>,
    /// Where a well-formed answer begins in what was heard.
    pub found: Finder,
}

pub fn t7_timing() -> Timing {
    Timing::t7(Serial::T7_DEFAULT)
}

fn t7_node(address: u8, degrees: i64) -> clino_sim::t7::T7 {
    use clino_sim::t7::{Identity, Model, Options, StoredSettings};
    let motion = [degrees, degrees + 10, degrees + 20].map(|angle| Motion::Constant(angle * DEGREE));
    let identity = Identity { model: Model::T73, ..Identity::default() };
    let settings = StoredSettings { address, ..StoredSettings::default() };
    clino_sim::t7::T7::new(identity, settings, Options { motion, ..Options::default() }).unwrap()
}

fn t7_answer(address: u8, degrees: i64, request: &t7::Request) -> Vec<u8> {
    let frame = request.encode(t7::Address::new(address).unwrap()).unwrap();
    answer_of(&mut t7_node(address, degrees), frame.as_bytes())
}

/// All 17 commands to node 5.
pub fn t7() -> Vec<Transaction<T7>> {
    use t7::Request;
    let offset = Millidegrees(12_345);
    let requests = [
        Request::GetAllAngles,
        Request::GetAngle(Axis::Zero),
        Request::GetAngle(Axis::One),
        Request::GetAngle(Axis::Two),
        Request::SetAngle { axis: Axis::Two, angle: offset },
        Request::GetAllAngleOffsets,
        Request::SetAngleOffset { axis: Axis::Two, offset },
        Request::GetAllData,
        Request::GetAllDirections,
        Request::SetDirection { axis: Axis::Two, direction: Direction::Reversed },
        Request::GetDamping,
        Request::SetDamping { damping_ms: 125 },
        Request::GetAngleOutputRange,
        Request::SetAngleOutputRange(Range::Unidirectional),
        Request::GetDeviceInformation,
        Request::SetBaudRate(BaudRate::B9600),
        Request::SetAddress {
            device_type: DeviceType::T7_3,
            serial: 25_033,
            new_address: t7::Address::new(9).unwrap(),
        },
    ];
    let transaction = |request: t7::Request| {
        let first = t7_answer(5, 30, &request);
        let (command, size) = (first[2], first.len());
        let other = if command == 0x8A { Request::GetAllDirections } else { Request::GetDamping };
        Transaction {
            address: t7::Address::new(5).unwrap(),
            second: t7_answer(5, -45, &request),
            other_node: t7_answer(6, 30, &request),
            other_command: t7_answer(5, 30, &other),
            found: Box::new(move |heard| expected::t7_answers(heard, 5, command, size).collect()),
            first,
            request,
        }
    };
    requests.into_iter().map(transaction).collect()
}

fn isu_node(address: u8, degrees: i64) -> clino_sim::isu::Isu {
    use clino_sim::isu::{ChecksumScope, Content, Eeprom, Options};
    let eeprom = Eeprom::factory(Content { address, ..Content::default() }, ChecksumScope::default(), 1);
    clino_sim::isu::Isu::new(
        eeprom,
        Options { motion: Motion::Constant(degrees * DEGREE), ..Options::default() },
    )
}

fn isu_answer(address: u8, degrees: i64, request: &isu::Request) -> Vec<u8> {
    let frame = request.encode(isu::Address::new(address).unwrap()).unwrap();
    answer_of(&mut isu_node(address, degrees), frame.as_bytes())
}

/// All seven functions to module 3; reading memory in three sizes, up to the longest.
pub fn isu() -> Vec<Transaction<Isu>> {
    use isu::Request;
    let words = Words::new(&[0x1234, 0x5678]).unwrap();
    let requests = [
        Request::GoToSoftErrorState,
        Request::ResetModule,
        Request::READ_ANGLE,
        Request::ReadRam { start: 0x40, count: 32 },
        Request::WriteRam { start: 0x58, data: Data::new(&[0x12, 0x34]).unwrap() },
        Request::ReadEeprom { start: 0x48, count: 8 },
        Request::WriteEeprom { start: 0x50, words },
        Request::ResetNullPosition,
    ];
    requests.into_iter().map(isu_transaction).collect()
}

/// The longest answers that there are.
pub fn longest_isu() -> Vec<Transaction<Isu>> {
    let requests = [
        isu::Request::ReadRam { start: 0x00, count: 253 },
        isu::Request::ReadEeprom { start: 0x00, count: 126 },
    ];
    requests.into_iter().map(isu_transaction).collect()
}

fn isu_transaction(request: isu::Request) -> Transaction<Isu> {
    use isu::Request;
    let first = isu_answer(3, 100, &request);
    let (head, size) = (first[1], first.len());
    let memory = (size > 3).then(|| first[2]);
    let other = match request {
        Request::ReadEeprom { .. } => Request::READ_ANGLE,
        _ => Request::ReadEeprom { start: 0x48, count: 2 },
    };
    Transaction {
        address: isu::Address::new(3).unwrap(),
        second: isu_answer(3, 25, &request),
        other_node: isu_answer(4, 100, &request),
        other_command: isu_answer(3, 100, &other),
        found: Box::new(move |heard| expected::isu_answers(heard, head, size, memory).collect()),
        first,
        request,
    }
}
