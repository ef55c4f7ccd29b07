//! From the arguments of `clino isu encode` to a command: each takes exactly the parameters it has.

use clino_codec::isu::{Function, Request};

use super::arguments::{Command, Parameters};
use super::memory;
use crate::parameter::{need, refuse_others};

impl Parameters {
    /// The command with these parameters.
    ///
    /// # Errors
    /// Which parameter is missing, malformed, or not one of this command.
    pub fn request(mut self, command: Command) -> Result<Request, String> {
        let name = command.name();
        let request = match command {
            Command::ReadAngle => Request::READ_ANGLE,
            Command::Function(function) => match function {
                Function::GoToSoftErrorState => Request::GoToSoftErrorState,
                Function::ResetModule => Request::ResetModule,
                Function::ReadRam => Request::ReadRam { start: self.start(name)?, count: self.count(name)? },
                Function::WriteRam => Request::WriteRam {
                    start: self.start(name)?,
                    data: memory::data(&need(name, "--data", &mut self.data)?)?,
                },
                Function::ReadEeprom => {
                    Request::ReadEeprom { start: self.start(name)?, count: self.count(name)? }
                }
                Function::WriteEeprom => Request::WriteEeprom {
                    start: self.start(name)?,
                    words: memory::words(&need(name, "--words", &mut self.words)?)?,
                },
                Function::ResetNullPosition => Request::ResetNullPosition,
            },
        };
        refuse_others(name, &self.left())?;
        Ok(request)
    }

    fn start(&mut self, name: &str) -> Result<u8, String> {
        need(name, "--start", &mut self.start)
    }

    fn count(&mut self, name: &str) -> Result<u8, String> {
        need(name, "--count", &mut self.count)
    }

    /// The parameters not yet used.
    fn left(&self) -> [(&'static str, bool); 4] {
        [
            ("--start", self.start.is_some()),
            ("--count", self.count.is_some()),
            ("--data", self.data.is_some()),
            ("--words", self.words.is_some()),
        ]
    }
}
