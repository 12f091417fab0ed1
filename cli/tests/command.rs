//! The real binary in a temporary folder.

mod real;

use std::fs;
use std::path::Path;
use std::process::Command;

use real::{HEADER, cdpr, fails, folder};

#[test]
fn broken_models_are_bad_input() {
    for (text, words) in [
        ("platform_mass = = 1\n", ["line 1", "platform_mass"]),
        ("\nplatform_mass = -1.0\n", ["line 2", "`platform_mass` is -1"]),
        ("anchor_radius = 9.0\n", ["attachment_radius", "anchor_radius"]),
        ("[start]\nphi = 1.6\n", ["line 2", "cable 1 runs through it"]),
        ("[start]\nx = 950.0\n", ["line 2", "inside the anchors"]),
        // Once taken for four cables, the rest unread.
        ("\nanchor_angle = [0, 1, 2, 3, 4, 5]\n", ["line 2", "`anchor_angle` is 6 angles, expected 4"]),
        ("[start]\nwinch_force = [1, 1, 1, 1, 1]\n", ["line 2", "`winch_force` has 5 entries, expected 4"]),
    ] {
        for command in ["simulate", "fmu"] {
            let arguments = [command, "--model", "m.toml", "-o", "out"];
            fails(&[("m.toml", text)], &arguments, 2, &[&["m.toml"], words.as_slice()].concat());
        }
    }
    let five = [("m.toml", "[start]\nwinch_force = [1, 1, 1, 1, 1]\n")];
    fails(&five, &["model", "--check", "m.toml"], 2, &["m.toml: line 2", "has 5 entries, expected 4"]);
    fails(&[], &["simulate", "--model", "none.toml", "-o", "out.csv"], 2, &["none.toml"]);
    fails(&[], &["simulate", "--input", "none.csv", "-o", "out.csv"], 2, &["none.csv"]);
}

#[test]
fn broken_tables_are_bad_input() {
    for (body, words) in [
        (format!("{HEADER}\n0,1,1,1,1\n1,1,x,1,1\n"), ["line 3", "winch_force[2]"]),
        (format!("{HEADER}\n1,1,1,1,1\n0,1,1,1,1\n"), ["line 3", "time"]),
        ("time,winch_force[1]\n0,1\n".to_owned(), ["line 1", "winch_force[2]"]),
        (String::new(), ["found nothing", "`time`"]),
        (HEADER.replace(',', ";") + "\n0;1;1;1;1\n", ["semicolons", "expected commas"]),
        (format!("{HEADER}\n0,1,1,,1\n"), ["line 2", "`winch_force[3]` is \"\""]),
        (format!("{HEADER}\n0,1,1,nan,1\n"), ["line 2", "`winch_force[3]` is \"nan\""]),
        (format!("{HEADER}\n"), ["no rows", "expected at least one"]),
    ] {
        let words = [&["in.csv"], words.as_slice()].concat();
        fails(&[("in.csv", &body)], &["simulate", "--input", "in.csv", "-o", "out.csv"], 2, &words);
    }
}

#[test]
fn wrong_use_is_told_from_failed_work() {
    fails(&[], &["simulate", "--step", "0", "-o", "out.csv"], 2, &["--step", "greater than 0"]);
    fails(&[], &["simulate", "--stop", "0", "-o", "out.csv"], 2, &["--stop"]);
    fails(&[], &["simulate", "--pose", "1,2", "-o", "out.csv"], 2, &["--pose", "X,Y,PHI"]);
    fails(&[], &["simulate", "--pose", "2000,0,0", "-o", "out.csv"], 2, &["2000", "inside the anchors"]);
    fails(&[], &["fmu", "--target", "beos", "-o", "a.fmu"], 2, &["beos", "linux64"]);
    let still = "initialization = \"static_equilibrium\"\n[start]\nwinch_force = [0.0, 0.0, 0.0, 0.0]\n\
                 disturbance_force_x = 1.0\n";
    fails(&[("m.toml", still)], &["simulate", "--model", "m.toml", "-o", "out.csv"], 1, &["no static equilibrium"]);
}

#[test]
fn a_run_that_fails_leaves_the_older_result() {
    let body = format!("{HEADER}\n0,1000,1000,1000,1000\n1,0,1e9,1e9,0\n");
    let folder = folder(&[("in.csv", &body), ("out.csv", "older")]);
    let output = cdpr(folder.path(), &["simulate", "--input", "in.csv", "--stop", "100", "-o", "out.csv"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(fs::read_to_string(folder.path().join("out.csv")).unwrap(), "older");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn results_are_an_input_table_again() {
    let body = format!("{HEADER},disturbance_torque\n0,1000,1100,1000,900,0\n0.5,1200,1000,900,1000,50\n");
    let folder = folder(&[("in.csv", &body)]);
    let run = |input: &str, out: &str| {
        let output = cdpr(folder.path(), &["simulate", "--input", input, "--stop", "2", "--step", "0.1", "-o", out]);
        assert!(output.status.success(), "{output:?}");
        fs::read_to_string(folder.path().join(out)).unwrap()
    };
    let first = run("in.csv", "a.csv");
    assert_eq!(first, run("a.csv", "b.csv"));
    assert_eq!(first.lines().count(), 22);
    assert_eq!(first.lines().next().unwrap().split(',').count(), 1 + 7 + 6 + 24 + 8 + 3);
}

#[test]
fn the_demo_makes_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let output = cdpr(folder.path(), &["demo", "--out", "a/b"]);
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    let mut names: Vec<String> =
        ["CablePlatform.fmu", "model.toml", "release.csv", "release.svg"].map(String::from).into();
    let found =
        ["report.html", "discovery.json", "CablePlatform.fmu", "gap.svg", "gap.csv", "recording.csv", "check.csv"];
    names.extend(found.map(|name| format!("missing_effect/{name}")));
    for name in names {
        let path = Path::new("a").join("b").join(&name);
        assert!(folder.path().join(&path).is_file(), "{name} is missing");
        assert!(said.contains(path.to_str().unwrap()), "{name} is not in {said}");
    }
    assert!(said.contains("to the last bit"), "{said}");
    assert!(said.contains("Coulomb friction on winch 3 and quadratic drag on the platform"), "{said}");
    assert!(!said.contains("not found"), "{said}");
    // What the FMU with the effects is off by, in multiples of the noise.
    let (_, after) = said.split_once("the FMU with what was found by ").unwrap();
    let after: f64 = after.lines().next().unwrap().trim_end_matches('.').parse().unwrap();
    assert!((0.9..1.2).contains(&after), "{said}");
}

/// A platform in a frame of 4 m by 3 m, on so many winches that hold their lengths.
fn framed(cables: usize) -> String {
    let mut text = "platform_mass = 20.0\nplatform_inertia = 0.8\ngravity = [0.0, -9.81]\nyoungs_modulus = 1e9\n\
                    cable_area = 1e-5\ncable_density = 0.05\ncable_damping = 500.0\n\
                    [winch]\ncommand = \"length\"\nrotor_inertia = 2e-4\ndrum_radius = 0.05\ngear_ratio = 10.0\n"
        .to_owned();
    for i in 0..cables {
        let (sin, cos) = (std::f64::consts::TAU * (i as f64 + 0.25) / cables as f64).sin_cos();
        let [x, y, a, b] = [2.0 * cos, 1.5 * sin, 0.2 * cos, 0.1 * sin];
        text.push_str(&format!("[[cable]]\nanchor = [{x}, {y}]\nattachment = [{a}, {b}]\n"));
    }
    text
}

#[test]
fn the_demo_of_a_robot_of_other_cables_drives_it() {
    for cables in [3, 8] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("my.toml"), framed(cables)).unwrap();
        let output = cdpr(folder.path(), &["demo", "--model", "my.toml", "--out", "mine"]);
        assert!(output.status.success(), "{output:?}");
        let said = String::from_utf8(output.stdout).unwrap();
        for name in ["CablePlatform.fmu", "run.csv", "run.svg"] {
            let path = Path::new("mine").join(name);
            assert!(folder.path().join(&path).is_file(), "{name} is missing");
            assert!(said.contains(path.to_str().unwrap()), "{name} is not in {said}");
        }
        assert!(said.contains(&format!("of {cables} cables")) && said.contains("to the last bit"), "{said}");
        let table = std::fs::read_to_string(folder.path().join("mine/run.csv")).unwrap();
        assert!(table.lines().next().unwrap().contains(&format!("winch_length[{cables}]")), "{table:.200}");
        assert_eq!(table.lines().count(), 1002);
    }
    fails(&[("my.toml", &framed(2))], &["demo", "--model", "my.toml", "--out", "mine"], 2, &["2 cables, expected 3"]);
}

#[test]
fn outputs_that_cannot_be_written_are_wrong_use() {
    for arguments in [["fmu", "-o"], ["simulate", "-o"]] {
        let with = |path: &'static str| [arguments.as_slice(), &[path]].concat();
        fails(&[], &with("no/out"), 2, &["no/out: cannot be written", "there is no folder no"]);
        fails(&[], &with("."), 2, &[".: cannot be written", "this is a folder"]);
        fails(&[("file", "")], &with("file/out"), 2, &["file/out: cannot be written"]);
    }
    // Before the run, not after it; and no table without its picture.
    fails(&[], &["simulate", "-o", "a.csv", "--plot", "no/a.svg"], 2, &["no/a.svg", "there is no folder no"]);
    fails(&[("taken", "")], &["demo", "--out", "taken"], 2, &["taken: the folder cannot be made"]);
}

#[test]
fn the_default_model_is_printed_whole_and_passes_its_check() {
    let printed = String::from_utf8(cdpr(Path::new("."), &["model"]).stdout).unwrap();
    let folder = folder(&[("model.toml", &printed)]);
    assert_eq!(
        real::done(folder.path(), &["model", "--check", "model.toml"]),
        "model.toml: a model with 4 cables and 0 effects; nothing is wrong with it\n"
    );
    // Every key with its unit or choices; those without effect and the effects as comments.
    for line in printed.lines().filter(|line| line.contains(" = ") && !line.starts_with('#')) {
        assert!(line.contains(" # "), "{line}");
    }
    for part in ["platform_mass = 2500.0", "kg m2", "# unstretched_length = [", "static_equilibrium", "# [[effect]]"] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    // What is printed as a comment is right as it stands.
    let example: String = printed.split_once("parameters:\n").unwrap().1.replace("# ", "");
    fs::write(folder.path().join("model.toml"), example).unwrap();
    assert!(real::done(folder.path(), &["model", "--check", "model.toml"]).contains("1 effect;"));
}

/// Whatever their number, the cables printed make a robot that every wrench can be asked of.
#[test]
fn a_robot_of_so_many_cables_is_printed_to_begin_with() {
    for cables in [3, 4, 6, 7, 12] {
        let count = cables.to_string();
        let printed = String::from_utf8(cdpr(Path::new("."), &["model", "--cables", &count]).stdout).unwrap();
        assert_eq!(printed.matches("[[cable]]").count(), cables, "{printed}");
        let folder = folder(&[("model.toml", &printed)]);
        let checked = real::done(folder.path(), &["model", "--check", "model.toml"]);
        assert_eq!(
            checked,
            format!("model.toml: a model with {cables} cables and 0 effects; nothing is wrong with it\n")
        );
        if cables > 3 {
            let held = real::done(folder.path(), &["analyse", "--model", "model.toml", "--pose", "10,5,0.1"]);
            assert!(held.contains("yes: any wrench can be made"), "{cables} cables: {held}");
        }
    }
    fails(&[], &["model", "--cables", "2"], 2, &["--cables", "3..=12"]);
    fails(&[("m.toml", "")], &["model", "--cables", "6", "--check", "m.toml"], 2, &["cannot be used with"]);
}

/// Its fifth column was left unread.
#[test]
fn a_table_for_more_cables_than_the_robot_has_is_refused() {
    let table =
        "time,winch_force[1],winch_force[2],winch_force[3],winch_force[4],winch_force[5]\n0,1,1,1,1,1\n1,1,1,1,1,1\n";
    let arguments = ["simulate", "--input", "in.csv", "-o", "out.csv"];
    fails(
        &[("in.csv", table)],
        &arguments,
        2,
        &["in.csv: line 1: column `winch_force[5]`, but the robot has 4 cables"],
    );
}

#[test]
fn errors_say_a_thing_once() {
    let folder = folder(&[]);
    let said = String::from_utf8(cdpr(folder.path(), &["fmu", "-o", "."]).stderr).unwrap();
    assert_eq!(said, "cdpr: .: cannot be written: this is a folder, expected the name of a file\n");
}

#[cfg(unix)]
mod unix {
    use std::io::Read;
    use std::os::unix::fs::symlink;
    use std::process::Stdio;

    use super::*;

    const SHORT: [&str; 6] = ["simulate", "--stop", "0.1", "--step", "0.05", "-o"];

    #[test]
    fn outputs_follow_links() {
        let folder = folder(&[("real.csv", "older")]);
        symlink("real.csv", folder.path().join("link.csv")).unwrap();
        assert!(cdpr(folder.path(), &[SHORT.as_slice(), &["link.csv"]].concat()).status.success());
        assert!(folder.path().join("link.csv").is_symlink());
        assert_eq!(fs::read_to_string(folder.path().join("real.csv")).unwrap().lines().count(), 4);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn outputs_go_into_pipes_and_devices() {
        let folder = folder(&[]);
        let table = cdpr(folder.path(), &[SHORT.as_slice(), &["/dev/stdout"]].concat());
        assert!(table.status.success(), "{table:?}");
        assert_eq!(String::from_utf8(table.stdout).unwrap().lines().count(), 4);
        // Into what the shell opened, where the shell left off.
        let mut shell = Command::new("sh");
        shell.args([
            "-c",
            "{ echo first; \"$0\" \"$@\" /dev/stdout; echo last; } > all.txt",
            env!("CARGO_BIN_EXE_cdpr"),
        ]);
        assert!(shell.args(SHORT).current_dir(folder.path()).status().unwrap().success());
        let all = fs::read_to_string(folder.path().join("all.txt")).unwrap();
        assert_eq!(all.lines().count(), 6);
        assert!(all.starts_with("first\ntime,") && all.ends_with("\nlast\n"), "{all}");
        // An archive with nothing after it.
        let fmu = cdpr(folder.path(), &["fmu", "-o", "/dev/stdout"]).stdout;
        assert!(fmu.starts_with(b"PK") && !fmu.ends_with(b"\n"));
        assert!(cdpr(folder.path(), &["fmu", "-o", "a.fmu"]).status.success());
        assert_eq!(fmu, fs::read(folder.path().join("a.fmu")).unwrap());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_named() {
        for arguments in [["simulate", "--stop", "100", "-o", "/dev/full"].as_slice(), &["fmu", "-o", "/dev/full"]] {
            fails(&[], arguments, 1, &["cdpr: /dev/full: cannot be written: No space left"]);
        }
    }

    #[test]
    fn a_reader_that_has_seen_enough_is_no_failure() {
        let folder = folder(&[]);
        let mut command = Command::new(env!("CARGO_BIN_EXE_cdpr"));
        command.args(["simulate", "--stop", "100", "-o", "/dev/stdout"]).current_dir(folder.path());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut first = [0; 5];
        child.stdout.take().unwrap().read_exact(&mut first).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!((&first, output.status.code(), output.stderr.as_slice()), (b"time,", Some(0), b"".as_slice()));
    }
}
