//! The checks.
use std::path::Path;
use super::run::{run, Setting, World, MS};
use clino_sim::motion::Motion;
/// Report.
pub struct Report;
/// All.
pub fn all(elf: &Path, bytes: &[u8], _registers: &str) -> Result<Report, String> {
    let world = World::default();
    let mut setting = Setting::default();
    setting.until = 400*MS;
    setting.motion[0] = Motion::Constant(12_345_000);
    setting.motion[1] = Motion::Constant(-45_500_000);
    setting.motion[2] = Motion::Constant(100_001_000);
    setting.motion[3] = Motion::Constant(90_000_000);
    setting.motion[4] = Motion::Constant(180_000_000);
    setting.motion[5] = Motion::Constant(45_000_000);
    let begun = std::time::Instant::now();
    let seen = run(elf, bytes, &setting, &world, &[0x4002_000c])?;
    println!("{:?} {} instructions", begun.elapsed(), seen.instructions);
    println!("{}", world.console.lock().unwrap().text());
    println!("{:?} {:?} {:x?} {:?}", seen.restarts, seen.complaints, seen.registers, seen.causes);
    for line in &seen.lines { let line = line.lock().unwrap(); println!("sent {} faults {:?} rel {:?}..{:?} lead {:?}..{:?} ch {:?}..{:?}", line.sent, line.faults.first(), line.releases.iter().min(), line.releases.iter().max(), line.leads.iter().min(), line.leads.iter().max(), line.characters.iter().min(), line.characters.iter().max()); }
    Ok(Report)
}
