//! The file of the log: whole rows only, on the disk within a second, a new one by size or day.
//!
//! A program that is killed leaves at most one row half written, at the end of the file. That end is cut off when the file is
//! opened again. Rows reach the system with [`File::hand_over`], whole ones with one write, and the disk with [`File::sync`],
//! which is `fdatasync`.
//!
//! A file that is full is renamed: `log.csv` to `log-2026-11-29T215219Z.csv`, the time of its end.

use std::fs;
use std::io::{self, ErrorKind, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::row::{Form, HEADER, Row};

/// Rows that wait for their write, in bytes.
const MOST_WAITING: usize = 64 * 1024;
/// How far from the end the last row is looked for at a time.
const CHUNK: u64 = 64 * 1024;
/// Characters of a day in a time of RFC 3339.
const DAY: usize = "2026-11-29".len();

/// When a new file begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    Never,
    Day,
    /// In bytes.
    Size(u64),
}

/// An open file.
#[derive(Debug)]
pub struct File {
    path: PathBuf,
    form: Form,
    rotation: Rotation,
    file: fs::File,
    /// Bytes in it.
    size: u64,
    /// The day of its rows; empty if it has none.
    day: String,
    waiting: String,
    /// What was handed over is on the disk.
    is_synced: bool,
    /// Bytes cut off when it was opened.
    cut: u64,
}

impl File {
    /// Opens or makes it, and cuts off a row that is not whole.
    ///
    /// # Errors
    /// Those of the system; a file that is no log of this form.
    pub fn open(path: &Path, form: Form, rotation: Rotation) -> io::Result<Self> {
        let mut file = fs::File::options().read(true).write(true).create(true).truncate(false).open(path)?;
        if !is_ours(&mut file, form)? {
            return Err(io::Error::new(
                ErrorKind::InvalidData,
                "it is no log of this form: it is left as it is",
            ));
        }
        let before = file.seek(SeekFrom::End(0))?;
        let size = last_end(&mut file, before)?;
        if size < before {
            file.set_len(size)?;
            file.sync_data()?;
        }
        let day = day_of_last(&mut file, size)?;
        file.seek(SeekFrom::Start(size))?;
        let mut log = Self {
            path: path.to_owned(),
            form,
            rotation,
            file,
            size,
            day,
            waiting: String::new(),
            is_synced: true,
            cut: before - size,
        };
        log.begin()?;
        Ok(log)
    }

    /// Bytes of a row that was not whole.
    pub fn cut(&self) -> u64 {
        self.cut
    }

    fn begin(&mut self) -> io::Result<()> {
        if self.size == 0 && self.form == Form::Csv {
            self.waiting.push_str(HEADER);
            self.sync()?;
        }
        Ok(())
    }

    /// Adds a row.
    ///
    /// # Errors
    /// Those of the system.
    pub fn write(&mut self, row: &Row) -> io::Result<()> {
        let text = row.text(self.form);
        let today = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
        let today = today.get(..DAY).unwrap_or_default();
        let is_full = match self.rotation {
            Rotation::Never => false,
            Rotation::Day => !self.day.is_empty() && self.day != today,
            Rotation::Size(most) => {
                let begun = if self.form == Form::Csv { HEADER.len() as u64 } else { 0 };
                let filled = self.size + self.waiting.len() as u64;
                filled > begun && filled + text.len() as u64 > most
            }
        };
        if is_full {
            self.rotate()?;
        }
        today.clone_into(&mut self.day);
        self.waiting.push_str(&text);
        if self.waiting.len() >= MOST_WAITING { self.hand_over() } else { Ok(()) }
    }

    /// All rows are the system's after this.
    ///
    /// # Errors
    /// Those of the system.
    pub fn hand_over(&mut self) -> io::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        self.is_synced = false;
        self.file.write_all(self.waiting.as_bytes())?;
        self.size += self.waiting.len() as u64;
        self.waiting.clear();
        Ok(())
    }

    /// All rows are on the disk after this.
    ///
    /// # Errors
    /// Those of the system.
    pub fn sync(&mut self) -> io::Result<()> {
        self.hand_over()?;
        if !std::mem::replace(&mut self.is_synced, true) {
            self.file.sync_data()?;
        }
        Ok(())
    }

    fn rotate(&mut self) -> io::Result<()> {
        self.sync()?;
        fs::rename(&self.path, self.full_name())?;
        let options = fs::File::options().read(true).write(true).create_new(true).open(&self.path);
        (self.file, self.size) = (options?, 0);
        self.day.clear();
        self.begin()
    }

    /// A name that no file has.
    fn full_name(&self) -> PathBuf {
        let time = humantime::format_rfc3339_seconds(SystemTime::now()).to_string().replace(':', "");
        let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
        let (stem, extension) = (part(self.path.file_stem()), part(self.path.extension()));
        let extension = if extension.is_empty() { extension } else { format!(".{extension}") };
        let named = |suffix: String| self.path.with_file_name(format!("{stem}-{time}{suffix}{extension}"));
        let mut names =
            std::iter::once(named(String::new())).chain((1_u32..).map(|number| named(format!("-{number}"))));
        names.find(|name| !name.exists()).unwrap_or_else(|| named(String::new()))
    }
}

/// Whether it is empty, or begins as a log does; a beginning that was interrupted counts.
fn is_ours(file: &mut fs::File, form: Form) -> io::Result<bool> {
    let start = if form == Form::Csv { HEADER } else { "{\"time\":\"" };
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.take(start.len() as u64).read_to_end(&mut bytes)?;
    Ok(start.as_bytes().starts_with(&bytes))
}

/// Where the last whole line ends.
fn last_end(file: &mut fs::File, size: u64) -> io::Result<u64> {
    let mut end = size;
    while end > 0 {
        let start = end.saturating_sub(CHUNK);
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(start))?;
        file.take(end - start).read_to_end(&mut bytes)?;
        if let Some(place) = bytes.iter().rposition(|&byte| byte == b'\n') {
            return Ok(start + place as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

/// The day of the last row, or nothing.
fn day_of_last(file: &mut fs::File, size: u64) -> io::Result<String> {
    let Some(before) = size.checked_sub(1) else { return Ok(String::new()) };
    let start = last_end(file, before)?;
    let mut text = String::new();
    file.seek(SeekFrom::Start(start))?;
    file.take(size - start).read_to_string(&mut text)?;
    let row = text.strip_prefix("{\"time\":\"").unwrap_or(&text);
    let is_row = row.as_bytes().first().is_some_and(u8::is_ascii_digit);
    Ok(row.get(..DAY).filter(|_| is_row).unwrap_or_default().to_owned())
}

/// `never`, `day`, or a size.
pub fn rotation(text: &str) -> Result<Rotation, String> {
    const LEAST: u64 = 1_000;
    let (number, scale) = match text {
        "never" => return Ok(Rotation::Never),
        "day" => return Ok(Rotation::Day),
        _ => match text.char_indices().next_back() {
            Some((end, 'k' | 'K')) => (text.get(..end), 1_000),
            Some((end, 'M')) => (text.get(..end), 1_000_000),
            Some((end, 'G')) => (text.get(..end), 1_000_000_000),
            _ => (Some(text), 1),
        },
    };
    let size =
        number.and_then(|number| number.parse::<u64>().ok()).and_then(|number| number.checked_mul(scale));
    match size {
        Some(size) if size >= LEAST => Ok(Rotation::Size(size)),
        _ => Err("not day, never, or a size of 1k at least, such as 500k, 10M, 1G".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::{Kind, Sensor};

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("clino-log-{name}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&path);
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn log(&self) -> PathBuf {
            self.0.join("log.csv")
        }

        fn files(&self) -> Vec<String> {
            let mut files: Vec<_> = fs::read_dir(&self.0)
                .unwrap()
                .map(|file| fs::read_to_string(file.unwrap().path()).unwrap())
                .collect();
            files.sort();
            files
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn row() -> Row {
        Row::without(SystemTime::now(), &Sensor { kind: Kind::Isu, address: 3, axis: None }, "no_answer")
    }

    #[test]
    fn a_row_that_is_not_whole_is_cut_off_wherever_it_ends() {
        let folder = Folder::new("torn");
        let whole = format!("{HEADER}2026-11-29T21:52:19.123456Z,t7,5,2,1,0.001,ok,0\n");
        for kept in 0..=whole.len() {
            fs::write(folder.log(), &whole[..kept]).unwrap();
            let mut file = File::open(&folder.log(), Form::Csv, Rotation::Never).unwrap();
            file.write(&row()).unwrap();
            file.sync().unwrap();
            let text = fs::read_to_string(folder.log()).unwrap();
            assert!(text.starts_with(HEADER) && text.ends_with(",no_answer,\n"), "{kept}: {text}");
            let is_whole = kept == whole.len();
            assert_eq!(text.lines().count(), if is_whole { 3 } else { 2 }, "{kept}: {text}");
            assert!(text.lines().all(|line| line.matches(',').count() == 7), "{kept}: {text}");
        }
    }

    #[test]
    fn a_long_torn_end_is_cut_off_too() {
        let folder = Folder::new("long");
        fs::write(folder.log(), format!("{HEADER}{}", "x".repeat(200_000))).unwrap();
        let file = File::open(&folder.log(), Form::Csv, Rotation::Never).unwrap();
        assert_eq!((file.cut(), fs::read_to_string(folder.log()).unwrap().as_str()), (200_000, HEADER));
    }

    #[test]
    fn the_file_of_another_is_left_as_it_is() {
        let folder = Folder::new("other");
        for (text, form) in [("a letter\n", Form::Csv), (HEADER, Form::Jsonl), ("{\"time\":\"", Form::Csv)] {
            fs::write(folder.log(), text).unwrap();
            assert!(File::open(&folder.log(), form, Rotation::Never).is_err(), "{text}");
            assert_eq!(fs::read_to_string(folder.log()).unwrap(), text);
        }
    }

    #[test]
    fn a_new_file_begins_by_size_and_loses_no_row() {
        let folder = Folder::new("size");
        let mut file = File::open(&folder.log(), Form::Csv, Rotation::Size(1_000)).unwrap();
        for _ in 0..100 {
            file.write(&row()).unwrap();
        }
        file.sync().unwrap();
        let files = folder.files();
        assert!(files.len() > 4, "{}", files.len());
        assert!(files.iter().all(|text| text.starts_with(HEADER) && text.len() <= 1_000));
        assert_eq!(files.iter().map(|text| text.lines().count() - 1).sum::<usize>(), 100);
    }

    #[test]
    fn a_new_file_begins_on_another_day() {
        let folder = Folder::new("day");
        let old = format!("{HEADER}2001-02-03T21:52:19.123456Z,isu,3,,1,0.005,ok,0\n");
        fs::write(folder.log(), &old).unwrap();
        for _ in 0..2 {
            let mut file = File::open(&folder.log(), Form::Csv, Rotation::Day).unwrap();
            file.write(&row()).unwrap();
            file.sync().unwrap();
        }
        let files = folder.files();
        assert_eq!(files.len(), 2, "{files:?}");
        assert!(files.contains(&old), "{files:?}");
        assert_eq!(fs::read_to_string(folder.log()).unwrap().lines().count(), 3);
    }

    #[test]
    fn sizes_are_read() {
        assert_eq!(rotation("500k"), Ok(Rotation::Size(500_000)));
        assert_eq!(rotation("10M"), Ok(Rotation::Size(10_000_000)));
        assert_eq!(rotation("1234"), Ok(Rotation::Size(1_234)));
        assert_eq!((rotation("day"), rotation("never")), (Ok(Rotation::Day), Ok(Rotation::Never)));
        for text in ["", "k", "999", "10m", "-1k", "99999999999999999999G", "1 M"] {
            assert!(rotation(text).is_err(), "{text}");
        }
    }
}
