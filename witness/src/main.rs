//! The firmware image on a second emulator, and two instruction interpreters held against each other.
mod cpu;
mod image;
fn main() {
    if std::env::args().nth(1).as_deref() == Some("image") { if let Err(e) = image::witness(std::path::Path::new(&std::env::args().nth(2).unwrap()), "") { println!("{e}"); } return; }
    let count = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1000);
    let seed = std::env::args().nth(2).and_then(|text| text.parse().ok()).unwrap_or(1);
    let begun = std::time::Instant::now();
    let outcome = cpu::sequences(count, seed);
    println!("{} of {} agreed, {:?}, fast {}", outcome.agreed, outcome.all, begun.elapsed(), outcome.by_fast_path);
    println!("{:#?}\n{:#?}\n{:?}\n{:?}", outcome.known, outcome.differing, outcome.endings, outcome.executed);
}
