//! Names of T7 things in JSON and in arguments. They do not change.

use clino_codec::angle::Range;
use clino_codec::t7::{DeviceType, Direction, Field, Opcode, Status};

/// Both output ranges.
pub const RANGES: [Range; 2] = [Range::Bidirectional, Range::Unidirectional];
/// Both directions.
pub const DIRECTIONS: [Direction; 2] = [Direction::Normal, Direction::Reversed];
/// Both types of device.
pub const DEVICE_TYPES: [DeviceType; 2] = [DeviceType::T7_1, DeviceType::T7_3];

/// The three Get Angle commands share a name; the axis is a parameter.
pub const fn command(opcode: Opcode) -> &'static str {
    match opcode {
        Opcode::GetAllAngles => "get_all_angles",
        Opcode::GetAngle0 | Opcode::GetAngle1 | Opcode::GetAngle2 => "get_angle",
        Opcode::SetAngle => "set_angle",
        Opcode::GetAllAngleOffsets => "get_all_angle_offsets",
        Opcode::SetAngleOffset => "set_angle_offset",
        Opcode::GetAllData => "get_all_data",
        Opcode::GetAllDirections => "get_all_directions",
        Opcode::SetDirection => "set_direction",
        Opcode::GetDamping => "get_damping",
        Opcode::SetDamping => "set_damping",
        Opcode::GetAngleOutputRange => "get_angle_output_range",
        Opcode::SetAngleOutputRange => "set_angle_output_range",
        Opcode::GetDeviceInformation => "get_device_information",
        Opcode::SetBaudRate => "set_baud_rate",
        Opcode::SetAddress => "set_address",
    }
}

pub const fn status(status: Status) -> &'static str {
    match status {
        Status::Success => "success",
        Status::InvalidCommand => "invalid_command",
        Status::InvalidParameter => "invalid_parameter",
        Status::ChecksumError => "checksum_error",
        Status::CommandFailed => "command_failed",
        Status::FlashEraseError => "flash_erase_error",
        Status::FlashProgramError => "flash_program_error",
        Status::AddressOutOfRange => "address_out_of_range",
        Status::Unknown(_) => "unknown",
    }
}

pub const fn direction(direction: Direction) -> &'static str {
    match direction {
        Direction::Normal => "normal",
        Direction::Reversed => "reversed",
    }
}

pub const fn range(range: Range) -> &'static str {
    match range {
        Range::Bidirectional => "bidirectional",
        Range::Unidirectional => "unidirectional",
    }
}

pub const fn device_type(device_type: DeviceType) -> &'static str {
    match device_type {
        DeviceType::T7_1 => "t7-1",
        DeviceType::T7_3 => "t7-3",
    }
}

pub const fn field(field: Field) -> &'static str {
    match field {
        Field::Angle => "angle_mdeg",
        Field::Offset => "offset_mdeg",
        Field::Axis => "axis",
        Field::Direction => "direction",
        Field::Damping => "damping_ms",
        Field::OutputRange => "output_range",
        Field::BaudRate => "baud",
        Field::DeviceType => "device_type",
        Field::NewAddress => "new_address",
    }
}
