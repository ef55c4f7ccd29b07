//! The shipped firmware image on the virtual board. Figures are taken from the wire log and the console, and are
//! compared with limits and truths that are restated here.

mod alarms;
mod altered;
#[cfg(unix)]
mod command_line;
mod commissioning;
mod console;
mod fast_path;
mod faults;
mod flood;
mod full_load;
mod hostile;
mod impaired;
mod long_times;
mod main_job;
mod meaning;
mod orders;
mod parts;
mod pictures;
mod port;
mod publication;
mod pwm;
mod registers;
mod saving;
mod scan;
mod settings;
mod summary;
mod throughput;
mod timing;
mod transcripts;
mod typing;
mod unplugging;
mod wrong_chip;
