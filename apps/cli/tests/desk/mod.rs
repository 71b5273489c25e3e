//! A folder of its own in which commands run, and what they must say when they are refused.

#![allow(dead_code, unreachable_pub, reason = "every test target is a crate of its own and uses another part")]

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use film::Image;
use tempfile::TempDir;

/// Commands and what they must say, split at blanks.
pub type Refusals<'a> = &'a [(&'a str, &'a [&'a str])];

/// A folder of its own; commands run in it.
pub struct Desk {
    folder: TempDir,
    /// What stands before the arguments of every command.
    command: &'static [&'static str],
    /// What is added to commands that must be refused, so that they get as far as to what is wrong with them.
    complete: fn(&mut Vec<&str>),
}

impl Desk {
    /// With these files in the folder.
    pub fn new(command: &'static [&'static str], complete: fn(&mut Vec<&str>), files: &[(&str, &[u8])]) -> Self {
        let desk = Self { folder: tempfile::tempdir().unwrap(), command, complete };
        for (name, content) in files {
            desk.write(name, content);
        }
        desk
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn image(&self, name: &str) -> Image {
        film::image::read(self.path(name)).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Everything in the folder with its content; folders have none.
    pub fn files(&self) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
        fn walk(folder: &Path, into: &mut BTreeMap<PathBuf, Option<Vec<u8>>>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    walk(&path, into);
                    into.insert(path, None);
                } else {
                    let content = fs::read(&path).unwrap();
                    into.insert(path, Some(content));
                }
            }
        }
        let mut files = BTreeMap::new();
        walk(self.folder.path(), &mut files);
        files
    }

    /// Names in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        self.files().keys().map(|path| path.file_name().unwrap_or_default().to_string_lossy().into_owned()).collect()
    }

    /// Names in a folder of the folder, sorted.
    pub fn names_in(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    pub fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cuticle"));
        command.current_dir(self.folder.path()).stdin(Stdio::null());
        command
    }

    pub fn run<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Answer {
        Answer::of(self.command().args(self.command).args(args))
    }

    pub fn feed<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>, input: &[u8]) -> Answer {
        // A file, not a pipe: nobody has to write and to read at once.
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(input).unwrap();
        file.rewind().unwrap();
        Answer::of(self.command().args(self.command).args(args).stdin(file))
    }

    /// Runs what must succeed; arguments are split at blanks.
    #[track_caller]
    pub fn good(&self, line: &str) -> Answer {
        let answer = self.run(line.split_whitespace());
        assert_eq!(answer.code, Some(0), "cuticle {line}\n{}", answer.err);
        assert!(!answer.err.contains("panicked"), "cuticle {line}\n{}", answer.err);
        answer
    }

    /// Runs what must be refused, and reports all that were not refused as they should be.
    #[track_caller]
    pub fn refuse(&self, cases: Refusals<'_>) {
        let report: String = cases
            .iter()
            .map(|(line, says)| {
                let mut args: Vec<&str> = line.split_whitespace().collect();
                (self.complete)(&mut args);
                self.refusal(&args, says)
            })
            .collect();
        assert!(report.is_empty(), "{report}");
    }

    /// The same for one, with its arguments as they are.
    #[track_caller]
    pub fn refuse_args(&self, args: &[&str], says: &[&str]) {
        let report = self.refusal(args, says);
        assert!(report.is_empty(), "{report}");
    }

    /// What is wrong with how `args` were refused; empty if nothing is.
    pub fn refusal(&self, args: &[&str], says: &[&str]) -> String {
        let before = self.files();
        let answer = Answer::of(frugal(&self.command()).args(self.command).args(args));
        let mut complaints = answer.complaints(says);
        // Whoever reads answers line by line has had some before the one that is refused.
        if args.first() != Some(&"fiber") && !answer.out.is_empty() {
            complaints.push("it wrote to the standard output".to_owned());
        }
        let after = self.files();
        for path in before.keys().chain(after.keys()) {
            if before.get(path) != after.get(path) {
                complaints.push(format!("{} was touched", path.display()));
            }
        }
        if complaints.is_empty() {
            return String::new();
        }
        let line = [self.command, args].concat().join(" ");
        format!("cuticle {line}\n  {}\n{}\n", complaints.join("\n  "), answer.err)
    }
}

/// The same command with a gigabyte of address space, where the system can be told so: what is refused needs a few
/// megabytes, and a header that is believed needs more than this.
pub fn frugal(command: &Command) -> Command {
    let program = command.get_program();
    let mut frugal = if cfg!(target_os = "linux") {
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -v 1048576; exec \"$0\" \"$@\""]).arg(program);
        shell
    } else {
        Command::new(program)
    };
    if let Some(folder) = command.get_current_dir() {
        frugal.current_dir(folder);
    }
    frugal.stdin(Stdio::null());
    frugal
}

/// What a command said, and how it ended.
pub struct Answer {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Answer {
    pub fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        Self { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }

    /// Whether a line of the output has exactly these words.
    pub fn has_row(&self, row: &str) -> bool {
        self.out.lines().any(|line| line.split_whitespace().eq(row.split_whitespace()))
    }

    #[track_caller]
    pub fn assert_refused(&self, says: &[&str]) {
        let complaints = self.complaints(says);
        assert!(complaints.is_empty(), "{complaints:#?}\n{}", self.err);
    }

    /// What keeps this from being a decent refusal that says all of `says`.
    pub fn complaints(&self, says: &[&str]) -> Vec<String> {
        let mut complaints = Vec::new();
        // 101 is a panic, nothing is a signal: both are defects, whatever was said.
        if !matches!(self.code, Some(1 | 2)) {
            complaints.push(format!("exit code {:?}, not 1 or 2", self.code));
        }
        if self.err.contains("panicked") {
            complaints.push("it panicked".to_owned());
        }
        complaints
            .extend(says.iter().filter(|what| !self.err.contains(**what)).map(|what| format!("does not say {what}")));
        complaints
    }
}
