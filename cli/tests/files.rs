//! Files that the command writes, and what is left of them when it cannot or may not.

mod real;

use std::fs;

use real::{HEADER, cdpr, done, fails, folder};

const SHORT: [&str; 5] = ["simulate", "--stop", "0.1", "--step", "0.05"];

fn short<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [SHORT.as_slice(), more].concat()
}

#[test]
fn one_file_is_not_written_twice() {
    let both = ["expected two different files"];
    fails(&[], &short(&["-o", "s", "--plot", "s"]), 2, &["--output and --plot are both s", both[0]]);
    fails(&[], &short(&["-o", "s", "--plot", "./s"]), 2, &both);
    let motion = [("t.csv", "time,x,y,phi\n0,0,0,0\n1,0,0,0\n")];
    fails(&motion, &["inverse", "--trajectory", "t.csv", "-o", "s", "--start", "s"], 2, &["--start", both[0]]);
    let analyse = ["analyse", "--pose", "0,0,0", "--start", "s", "--linear", "s"];
    fails(&[], &analyse, 2, &["--start and --linear", both[0]]);
}

#[test]
fn a_file_is_what_its_name_says() {
    fails(&[], &short(&["-o", "run.xlsx"]), 2, &["run.xlsx", "ends in .xlsx, expected .csv"]);
    fails(&[], &short(&["-o", "a.csv", "--plot", "a.jpg"]), 2, &["ends in .jpg, expected .svg or .png"]);
    let analyse = |more: [&'static str; 2]| [["analyse", "--pose", "0,0,0"].as_slice(), &more].concat();
    fails(&[], &analyse(["--workspace", "m.svg"]), 2, &["ends in .svg, expected .csv"]);
    fails(&[], &analyse(["--linear", "l.csv"]), 2, &["ends in .csv, expected .json"]);
    fails(&[], &["fmu", "-o", "a.zip"], 2, &["ends in .zip, expected .fmu"]);
    let folder = folder(&[]);
    done(folder.path(), &short(&["-o", "a.csv", "--plot", "a.png"]));
    done(folder.path(), &short(&["-o", "b.out", "--plot", "b.SVG"]));
    assert!(fs::read(folder.path().join("a.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(fs::read(folder.path().join("b.SVG")).unwrap().starts_with(b"<svg"));
}

#[test]
fn a_missing_temporary_folder_is_told_before_the_work() {
    let folder = folder(&[]);
    let run = ["simulate", "--stop", "2", "--step", "0.02", "-o", "run.csv"];
    done(folder.path(), &run);
    for arguments in [["discover", "--data", "run.csv", "--out", "found"].as_slice(), &["fmu", "-o", "a.fmu"]] {
        let mut command = real::command(folder.path(), arguments);
        let output = command.env("TMPDIR", "/no/such").env("TEMP", "/no/such").env("TMP", "/no/such").output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("the temporary folder /no/such: ") && said.contains("TMPDIR names another"), "{said}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "{arguments:?} left something behind");
    }
}

#[cfg(unix)]
mod unix {
    use std::os::unix::process::ExitStatusExt;
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::Duration;

    use super::*;

    #[test]
    fn an_interrupted_run_leaves_no_partial_file() {
        for (name, number) in [("-INT", 2), ("-TERM", 15)] {
            let folder = folder(&[("out.csv", "older")]);
            let mut command = real::command(folder.path(), &["simulate", "--stop", "1e5", "-o", "out.csv"]);
            let mut child = command.stderr(Stdio::null()).spawn().unwrap();
            let partial = || {
                let names = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
                names.filter(|name| name.to_string_lossy().ends_with(".partial")).count()
            };
            while partial() == 0 {
                assert_eq!(child.try_wait().unwrap(), None, "it has ended by itself");
                sleep(Duration::from_millis(20));
            }
            assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
            assert_eq!(child.wait().unwrap().signal(), Some(number), "ended as a shell expects it");
            assert_eq!(partial(), 0);
            assert_eq!(fs::read_to_string(folder.path().join("out.csv")).unwrap(), "older");
        }
    }

    #[test]
    fn escape_codes_in_names_never_reach_the_terminal() {
        let name = "\u{1b}[31mred.csv";
        let body = format!("{HEADER}\n0,1,1,1,1\n1,1,1,1,1\n");
        let folder = folder(&[("in.csv", &body)]);
        fs::write(folder.path().join("\u{1b}[2J.toml"), "x\u{1b} = 1").unwrap();
        for arguments in [
            ["simulate", "--input", name, "-o", "out.csv"].as_slice(),
            &["simulate", "--model", "\u{1b}[2J.toml", "-o", "out.csv"],
            &["model", "--check", "\u{1b}[2J.toml"],
            &["analyse", "--pose", "0,0,0", "--linear", "\u{1b}[1m.json"],
            &["fmu", "-o", "\u{1b}[1m.fmu"],
        ] {
            let output = cdpr(folder.path(), arguments);
            let said = [output.stdout, output.stderr].concat();
            assert!(!said.contains(&0x1b), "{arguments:?}: {}", String::from_utf8_lossy(&said));
            assert!(String::from_utf8(said).unwrap().contains("\\u{1b}"), "{arguments:?}");
        }
        // Wrong use is told in colours on a terminal, but never in those of a name.
        for arguments in [["simulate", "--step", name, "-o", "out.csv"].as_slice(), &[name]] {
            let told = real::command(folder.path(), arguments).env("CLICOLOR_FORCE", "1").output().unwrap().stderr;
            assert!(!told.contains(&0x1b), "{}", String::from_utf8_lossy(&told));
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn full_devices_for_messages_are_no_panic() {
        let full = || fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let folder = folder(&[]);
        let code = |arguments: &[&str]| {
            real::command(folder.path(), arguments).stdout(full()).stderr(full()).status().unwrap().code()
        };
        assert_eq!(code(&["simulate", "-o", "no/a.csv"]), Some(2));
        assert_eq!(code(&["simulate"]), Some(2));
        assert_eq!(code(&["effects"]), Some(1));
        assert_eq!(code(&["--help"]), Some(1));
        let told = real::command(folder.path(), &["--help"]).stdout(full()).output().unwrap();
        let told = String::from_utf8(told.stderr).unwrap();
        assert!(told.starts_with("cdpr: standard output: cannot be written: No space left"), "{told}");
    }

    #[test]
    fn help_into_a_closed_pipe_is_no_failure() {
        let folder = folder(&[]);
        for arguments in [["--help"].as_slice(), &["simulate", "--help"], &["effects"], &["model"]] {
            let mut child =
                real::command(folder.path(), arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
            drop(child.stdout.take());
            let output = child.wait_with_output().unwrap();
            assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), b"".as_slice()), "{arguments:?}");
        }
    }
}
