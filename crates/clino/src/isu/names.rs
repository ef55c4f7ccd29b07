//! Names of ISU things in JSON and in arguments. They do not change.

use clino_codec::isu::{DeviceError, Function};

pub const fn function(function: Function) -> &'static str {
    match function {
        Function::GoToSoftErrorState => "go_to_soft_error_state",
        Function::ResetModule => "reset_module",
        Function::ReadRam => "read_ram",
        Function::WriteRam => "write_ram",
        Function::ReadEeprom => "read_eeprom",
        Function::WriteEeprom => "write_eeprom",
        Function::ResetNullPosition => "reset_null_position",
    }
}

pub const fn device_error(error: DeviceError) -> &'static str {
    match error {
        DeviceError::InvalidFunctionCode => "invalid_function_code",
        DeviceError::InvalidChecksum => "invalid_checksum",
        DeviceError::HardwareError { .. } => "hardware_error",
    }
}
