//! `cdpr inverse`, `cdpr analyse` and `cdpr paper` as a user runs them.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

fn cdpr(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cdpr")).current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stdout)
}

/// A circle of 5 m in 60 s, from rest to rest.
fn circle() -> String {
    let mut table = "time,x,y,phi,disturbance_force_x\n".to_owned();
    for k in 0..=60 {
        let s = f64::from(k) / 60.0;
        let turn = std::f64::consts::TAU * s.powi(4) * (35.0 - 84.0 * s + 70.0 * s * s - 20.0 * s.powi(3));
        let _ = writeln!(table, "{k},{:?},{:?},0.0,100", 5.0 * turn.sin(), 5.0 * (1.0 - turn.cos()));
    }
    table
}

#[test]
fn forces_of_a_trajectory_drive_a_simulation_along_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("circle.csv"), circle()).unwrap();
    let bounds = ["--tension-min", "5000", "--tension-max", "35000", "--ends", "rest"];
    let mut arguments = vec![
        "inverse",
        "--trajectory",
        "circle.csv",
        "--step",
        "0.01",
        "--held",
        "-o",
        "forces.csv",
        "--start",
        "m.toml",
    ];
    arguments.extend(bounds);
    let told = done(&cdpr(at, &arguments));
    assert!(told.contains("6001 rows"), "{told}");
    done(&cdpr(at, &["simulate", "--model", "m.toml", "--input", "forces.csv", "--step", "1", "-o", "run.csv"]));
    let mut run = csv::Reader::from_path(at.join("run.csv")).unwrap();
    let header = run.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let (x, y) = (column("x"), column("y"));
    let wanted = circle();
    let mut rows = 0;
    for (row, line) in run.records().map(Result::unwrap).zip(wanted.lines().skip(1)) {
        let asked: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        for (k, column) in [(1, x), (2, y)] {
            let reached: f64 = row[column].parse().unwrap();
            // The forces are held for 10 ms each.
            assert!((reached - asked[k]).abs() < 1e-4, "t {}: {reached} against {}", asked[0], asked[k]);
        }
        rows += 1;
    }
    assert_eq!(rows, 61);
}

#[test]
fn impossible_motions_and_bad_tables_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("circle.csv"), circle()).unwrap();
    let narrow = cdpr(
        at,
        &["inverse", "--trajectory", "circle.csv", "-o", "f.csv", "--tension-min", "5000", "--tension-max", "5010"],
    );
    assert_eq!(narrow.status.code(), Some(1));
    let told = text(&narrow.stderr);
    for part in ["at t = ", "no tensions within the bounds", "nearest", "short by"] {
        assert!(told.contains(part), "{told}");
    }
    assert!(!at.join("f.csv").exists(), "nothing is written where the work failed");
    std::fs::write(at.join("bad.csv"), "time,x,y,phi\n0,0,0,0\n1,0,zero,0\n").unwrap();
    let bad = cdpr(at, &["inverse", "--trajectory", "bad.csv", "-o", "f.csv"]);
    assert_eq!(bad.status.code(), Some(2));
    assert!(text(&bad.stderr).contains("bad.csv: line 3: `y` is \"zero\""), "{}", text(&bad.stderr));
    std::fs::write(at.join("far.csv"), "time,x,y,phi\n0,0,0,0\n1000,5000,0,0\n").unwrap();
    let far = cdpr(at, &["inverse", "--trajectory", "far.csv", "-o", "f.csv"]);
    assert_eq!(far.status.code(), Some(2));
    let wrong =
        cdpr(at, &["inverse", "--trajectory", "circle.csv", "-o", "f.csv", "--tension-min", "9", "--tension-max", "5"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("--tension-max is 5"), "{}", text(&wrong.stderr));
    assert!(!at.join("f.csv").exists());
}

/// A start within half a second takes 2.5 kN of the cables' own inertia, more than the least tension.
#[test]
fn winch_forces_keep_within_their_limits_or_a_warning_says_where_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut table = "time,x,y,phi\n".to_owned();
    for k in 0..=40 {
        let turn = std::f64::consts::TAU * f64::from(k) / 120.0;
        let _ = writeln!(table, "{:?},{:?},{:?},0.0", 0.5 * f64::from(k), 5.0 * turn.cos(), 5.0 * turn.sin());
    }
    std::fs::write(at.join("sudden.csv"), table).unwrap();
    let run = |more: &[&str]| {
        let common = ["inverse", "--trajectory", "sudden.csv", "--ends", "rest", "--step", "0.02", "-o", "f.csv"];
        cdpr(at, &[&common[..], &["--objective", "minimum-norm", "--smooth", "500"], more].concat())
    };
    let least = |told: &str| -> f64 {
        let line = told.lines().find(|line| line.starts_with("winch forces")).unwrap();
        line.split_whitespace().nth(2).unwrap().parse().unwrap()
    };
    let free = run(&["--force-min", "-1e5"]);
    assert!(least(&done(&free)) < -1000.0, "{}", text(&free.stdout));
    let kept = run(&[]);
    assert!(least(&done(&kept)) >= 0.0 && !text(&kept.stderr).contains("warning"), "{}", text(&kept.stdout));
    let warned = text(&run(&["--tension-max", "12000", "--force-max", "9500", "--force-min", "2500"]).stderr);
    assert!(warned.contains("t = ") && warned.contains("winch"), "{warned}");
    let refused = run(&["--force-max", "500"]);
    assert_eq!(refused.status.code(), Some(1));
    for part in ["at t = ", "winch 1 keeps within the limits of its force", "none is within the bounds of tension"] {
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
    }
    let wrong = run(&["--force-min", "5", "--force-max", "5"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("--force-max is 5"), "{}", text(&wrong.stderr));
}

/// Exit code 2, a message that names what is wrong, and no file left behind.
#[test]
fn bad_input_is_named_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("circle.csv"), circle()).unwrap();
    std::fs::write(at.join("out.csv"), "time,x,y,phi\n0,0,0,0\n\n1,2000,0,0\n").unwrap();
    std::fs::write(at.join("back.csv"), "time,x,y,phi\n0,0,0,0\n2,0,0,0\n1,0,0,0\n").unwrap();
    std::fs::write(at.join("short.csv"), "time,x,y\n0,0,0\n").unwrap();
    std::fs::write(at.join("delay.toml"), "[[effect]]\nid = \"winch_delay\"\ndelay = 0.1\n").unwrap();
    let files = || std::fs::read_dir(at).unwrap().count();
    let before = files();
    let inverse = |more: &[&'static str]| [&["inverse", "-o", "f.csv", "--trajectory"], more].concat();
    for (arguments, parts) in [
        (inverse(&["none.csv"]), vec!["none.csv: "]),
        (inverse(&["short.csv"]), vec!["short.csv: line 1: no column `phi`", "found \"time, x, y\""]),
        (inverse(&["back.csv"]), vec!["back.csv: line 4: `time` is 1, expected more than 2"]),
        (inverse(&["out.csv"]), vec!["out.csv: line 4: `pose` is [2000, 0, 0], expected a pose inside the anchors"]),
        (inverse(&["circle.csv", "--model", "none.toml"]), vec!["none.toml: "]),
        (inverse(&["circle.csv", "--model", "delay.toml"]), vec!["delay.toml: ", "winch_delay"]),
        (
            inverse(&["circle.csv", "--tension-min", "-5"]),
            vec!["--tension-min is -5, expected a finite number, 0 or more"],
        ),
        (inverse(&["circle.csv", "--tension-min", "9", "--tension-max", "5"]), vec!["--tension-max is 5", "above"]),
        (vec!["analyse", "--pose", "2000,0,0"], vec!["--pose", "[2000, 0, 0]", "inside the anchors"]),
        (vec!["analyse", "--pose", "0,0,0", "--tension-min", "-1"], vec!["--tension-min is -1"]),
        (vec!["analyse", "--pose", "0,0,0", "--wrench", "-1,0,0"], vec!["--wrench has -1"]),
        (vec!["analyse", "--pose", "0,0,0", "--model", "none.toml"], vec!["none.toml: "]),
        (vec!["paper", "--out", "circle.csv"], vec!["--out is circle.csv, expected a folder"]),
    ] {
        let output = cdpr(at, &arguments);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        for part in parts {
            assert!(told.contains(part), "{arguments:?}: {told}");
        }
        assert_eq!(files(), before, "{arguments:?} left a file behind");
    }
}

#[test]
fn an_analysis_tells_where_locked_winches_hold_the_platform() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("circle.csv"), circle()).unwrap();
    done(&cdpr(
        at,
        &[
            "inverse",
            "--trajectory",
            "circle.csv",
            "-o",
            "f.csv",
            "--start",
            "m.toml",
            "--ends",
            "rest",
            "--tension-max",
            "3000",
        ],
    ));
    // A wind of 100 N blows; the lengths are those of the pose in it, found from a pose beside it.
    let told = done(&cdpr(at, &["analyse", "--model", "m.toml", "--pose", "0.5,-0.2,0.01"]));
    let locked = told.split("winches locked at the model's unstretched lengths").nth(1).unwrap();
    let line = locked.lines().nth(1).unwrap();
    assert!(line.ends_with("stable") && !line.ends_with("unstable"), "{told}");
    let numbers: Vec<f64> =
        line.split(|c: char| !(c.is_ascii_digit() || "-.e".contains(c))).filter_map(|part| part.parse().ok()).collect();
    assert!(numbers.len() == 3 && numbers.iter().all(|v| v.abs() < 1e-5), "{line}");
    let plain = done(&cdpr(at, &["analyse", "--pose", "0,0,0"]));
    assert!(!plain.contains("unstretched lengths ["), "the default model gives no lengths: {plain}");
}

#[test]
fn a_pose_that_is_not_held_has_no_linear_model_and_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("wind.toml"), "[start]\ndisturbance_force_x = 1e6\n").unwrap();
    let analyse = ["analyse", "--model", "wind.toml", "--pose", "0,0,0"];
    let told = done(&cdpr(at, &analyse));
    for part in ["no: at t = 0 s: no tensions within the bounds", "nearest tensions"] {
        assert!(told.contains(part), "{told}");
    }
    let linear = cdpr(at, &[&analyse[..], &["--linear", "l.json", "--workspace", "w.csv"]].concat());
    assert_eq!(linear.status.code(), Some(1));
    let told = text(&linear.stderr);
    assert!(told.contains("not held") && told.contains("no tensions within the bounds"), "{told}");
    assert!(!at.join("l.json").exists() && !at.join("w.csv").exists());
}

#[test]
fn an_analysis_tells_stiffness_modes_and_workspace_and_writes_the_linear_model() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let told = done(&cdpr(
        at,
        &[
            "analyse",
            "--pose",
            "0,0,0",
            "--tension-max",
            "2000",
            "--tension-min",
            "0",
            "--linear",
            "l.json",
            "--workspace",
            "w.csv",
            "--points",
            "11",
        ],
    ));
    // Tensions of 1 kN: the periods of the closed forms, and those of locked winches.
    for part in ["226.", "221.", "grows in 29.5", "1.73", "1.77", "1.43", "unstable", "wrench closure         yes"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let linear: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(at.join("l.json")).unwrap()).unwrap();
    let rows = |name: &str| linear[name].as_array().unwrap().len();
    let names = |name: &str| {
        linear[name].as_array().unwrap().iter().map(|n| n.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!((rows("A"), rows("B"), rows("C"), rows("D")), (14, 14, 41, 41));
    assert_eq!(names("states")[6], "unstretched_length[1]");
    assert_eq!(names("inputs").len(), 7);
    assert_eq!(linear["A"][0][3], 1.0);
    let map = std::fs::read_to_string(at.join("w.csv")).unwrap();
    assert_eq!(map.lines().count(), 122);
    let outside = cdpr(at, &["analyse", "--pose", "2000,0,0"]);
    assert_eq!(outside.status.code(), Some(2));
    assert!(text(&outside.stderr).contains("inside the anchors"), "{}", text(&outside.stderr));
}

#[test]
fn the_robot_is_drawn_at_a_pose_with_its_cables_by_number() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let told = done(&cdpr(at, &["analyse", "--pose", "50,-20,0.3", "--plot", "robot.svg"]));
    assert!(told.contains("robot.svg"), "{told}");
    let svg = std::fs::read_to_string(at.join("robot.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let with = |class: &str| document.descendants().filter(|n| n.attribute("class") == Some(class)).count();
    assert_eq!((with("robot-cable"), with("robot-number"), with("robot-platform")), (4, 4, 1));
    assert!(svg.contains("x = 50 m, y = -20 m, φ = 0.3 rad; platform drawn"), "{svg}");
    let refused = cdpr(at, &["analyse", "--pose", "0,0,0", "--plot", "robot.pdf"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("expected .svg or .png"), "{}", text(&refused.stderr));
    assert!(!at.join("robot.pdf").exists());
    done(&cdpr(at, &["analyse", "--pose", "0,0,0", "--plot", "robot.png"]));
    assert!(std::fs::read(at.join("robot.png")).unwrap().starts_with(b"\x89PNG"));
}

/// Bars on two points, held from the left and from the right: the wrench closes where the line through the platform passes
/// between the anchors on both sides.
const BAR: &str = "[[cable]]\nanchor = [-2.0, -1.0]\nattachment = [-0.2, 0.0]\n[[cable]]\nanchor = [-2.0, 1.0]\n\
    attachment = [-0.2, 0.0]\n[[cable]]\nanchor = [2.0, -1.0]\nattachment = [0.2, 0.0]\n[[cable]]\n\
    anchor = [2.0, 1.0]\nattachment = [0.2, 0.0]\n[start]\nwinch_force = [1.0, 1.0, 1.0, 1.0]\n";

#[test]
fn a_workspace_over_orientations_is_a_table_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("bar.toml"), BAR).unwrap();
    let analyse = ["analyse", "--model", "bar.toml", "--pose", "0,0,0", "--points", "20"];
    let map = ["--workspace", "w.csv", "--angles", "-0.2,0.3,6", "--area", "-1.8,-1.2,1.8,1.2", "--plot", "w.svg"];
    let told = done(&cdpr(at, &[&analyse[..], &map].concat()));
    assert!(told.contains("workspace at 6 angles from -0.2 to 0.3 rad"), "{told}");
    let table = std::fs::read_to_string(at.join("w.csv")).unwrap();
    let rows = columns(&table, &["x", "y", "phi", "reachable", "closure", "closure_share"]);
    assert_eq!(rows.len(), 20 * 20 * 6);
    let closes =
        |x: f64, y: f64, phi: f64| [-2.0, 2.0].into_iter().all(|side| (y + (side - x) * phi.tan()).abs() < 1.0);
    let angles = [-0.2, -0.1, 0.0, 0.1, 0.2, 0.3];
    let mut shares = std::collections::BTreeSet::new();
    for row in rows {
        let [x, y, phi, reachable, closure, share] = row[..] else { panic!("{row:?}") };
        // A platform that sticks out between the anchors is not reachable.
        if y.abs() + 0.2 < 1.0 {
            assert_eq!((reachable, closure), (1.0, f64::from(u8::from(closes(x, y, phi)))), "{x} {y} {phi}");
            let held = angles.iter().filter(|phi| closes(x, y, **phi)).count();
            assert!((share - held as f64 / 6.0).abs() < 1e-12, "{x} {y}: {share}, {held} angles");
            shares.insert(held);
        }
    }
    assert!(shares.len() > 4, "{shares:?}");
    let svg = std::fs::read_to_string(at.join("w.svg")).unwrap();
    for class in ["filled", "pale", "outlined", "dashed"] {
        assert_eq!(svg.matches(&format!("class=\"robot-area-{class}\"")).count(), 2, "{class}");
    }
    for (more, part) in [
        (vec!["--angles", "0.3,0.1,4", "--workspace", "a.csv"], "the smaller angle first"),
        (vec!["--angles", "0.1,0.3,10000", "--workspace", "a.csv", "--points", "2000"], "20000000 or fewer"),
        (vec!["--area", "1,0,0,1", "--workspace", "a.csv"], "the lower left corner"),
        (vec!["--angles", "0.1,0.3,4"], "--workspace"),
    ] {
        let refused = cdpr(at, &[&["analyse", "--model", "bar.toml", "--pose", "0,0,0"][..], &more].concat());
        assert_eq!(refused.status.code(), Some(2), "{more:?}");
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
        assert!(!at.join("a.csv").exists());
    }
}

/// A load of 50 kg hangs on two cables of at most 400 N: feasible where each carries its part by the triangle of forces.
#[test]
fn a_hanging_load_is_feasible_where_both_cables_can_carry_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let cable = |x: f64| format!("[[cable]]\nanchor = [{x:?}, 0.0]\nattachment = [0.0, 0.0]\n");
    let head = "platform_mass = 50.0\ngravity = [0.0, -9.81]\n[start]\nwinch_force = [1.0, 1.0]\n";
    std::fs::write(at.join("load.toml"), head.to_owned() + &cable(-2.0) + &cable(2.0)).unwrap();
    let analyse = ["analyse", "--model", "load.toml", "--pose", "0,-3,0", "--workspace", "w.csv", "--points", "24"];
    let bounds = ["--tension-min", "20", "--tension-max", "400"];
    let flat = cdpr(at, &[&analyse[..], &bounds].concat());
    assert_eq!(flat.status.code(), Some(2));
    assert!(text(&flat.stderr).contains("no area; say which one by --area"), "{}", text(&flat.stderr));
    done(&cdpr(at, &[&analyse[..], &bounds, &["--area", "-2.3,-3.1,2.3,-0.1"]].concat()));
    let (mut held, mut dropped) = (0, 0);
    for row in columns(&std::fs::read_to_string(at.join("w.csv")).unwrap(), &["x", "y", "feasible"]) {
        let [x, y, feasible] = row[..] else { panic!("{row:?}") };
        let carried = |side: f64| 50.0 * 9.81 * (x + side).hypot(y) * (side - x) / (4.0 * -y) * side.signum();
        let both = [2.0, -2.0].into_iter().all(|side| (20.0..=400.0).contains(&carried(side)));
        assert_eq!(feasible, f64::from(u8::from(both)), "{x} {y}: {} {}", carried(2.0), carried(-2.0));
        if both { held += 1 } else { dropped += 1 }
    }
    assert!(held > 100 && dropped > 100, "{held} {dropped}");
}

/// A platform of 4 kg was held by 1 kN and more, which pulled its cables to twice their length, whatever --pretension said.
#[test]
fn a_small_robot_is_held_by_small_tensions() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let cable = |x: f64, y: f64| {
        format!("[[cable]]\nanchor = [{x:?}, {y:?}]\nattachment = [{:?}, {:?}]\n", 0.1 * x.signum(), -0.05 * y.signum())
    };
    let cables: String = [(-1.0, 0.7), (1.0, 0.7), (1.0, -0.7), (-1.0, -0.7)].map(|(x, y)| cable(x, y)).concat();
    let head = "platform_mass = 4.0\nplatform_inertia = 0.05\nyoungs_modulus = 2e9\ncable_area = 3e-6\n";
    let winch = "[winch]\ncommand = \"torque\"\ndrum_radius = 0.02\ngear_ratio = 5.0\nrotor_inertia = 1e-5\n";
    std::fs::write(at.join("small.toml"), format!("{head}{winch}{cables}")).unwrap();
    let analyse = ["analyse", "--model", "small.toml", "--pose", "0,0,0"];
    assert!(done(&cdpr(at, &analyse)).contains("tensions 1.6 to 80 N"));
    let held = done(&cdpr(at, &[&analyse[..], &["--pretension", "40"]].concat()));
    assert!(held.contains("unstretched (m)   winch_torque (N.m)"), "{held}");
    let first = held.lines().skip_while(|line| !line.starts_with("held")).nth(2).unwrap();
    let values: Vec<f64> = first.split_whitespace().map(|v| v.parse().unwrap()).collect();
    for (found, expected) in [(values[1], 40.0), (values[2], 40.0), (values[4], 40.0 * 0.02 / 5.0)] {
        assert!((found - expected).abs() < 1e-4 * expected, "{first}");
    }
    let refused = cdpr(at, &[&analyse[..], &["--pretension", "400"]].concat());
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("--pretension is 400, expected from 1.6 to 80 N; --tension-min"));
    done(&cdpr(at, &[&analyse[..], &["--pretension", "400", "--tension-max", "500"]].concat()));
}

/// The table `run` of a simulation or inverse dynamics as rows of columns by name.
fn columns(text: &str, names: &[&str]) -> Vec<Vec<f64>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().unwrap().clone();
    let places: Vec<usize> = names.iter().map(|n| header.iter().position(|h| h == *n).unwrap()).collect();
    let rows = reader.records().map(Result::unwrap);
    rows.map(|row| places.iter().map(|k| row[*k].parse().unwrap()).collect()).collect()
}

#[test]
fn disturbances_of_the_start_act_in_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let write = |name: &str, text: &str| std::fs::write(at.join(name), text).unwrap();
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    write("wind.toml", "[start]\ndisturbance_force_x = 120.0\ndisturbance_torque = -900.0\n");
    let forces = "time,winch_force[1],winch_force[2],winch_force[3],winch_force[4]";
    write("in.csv", &format!("{forces}\n0,1000,1000,1000,1000\n5,1000,1000,1000,1000\n"));
    write("both.csv", &format!("{forces},disturbance_force_x,disturbance_torque\n0,1000,1000,1000,1000,120,-900\n"));
    let run = |more: &[&str]| {
        done(&cdpr(at, &[&["simulate", "--stop", "5", "--step", "1", "-o", "run.csv"], more].concat()));
        read("run.csv")
    };
    let named = run(&["--input", "both.csv"]);
    assert_eq!(run(&["--model", "wind.toml", "--input", "in.csv"]), named);
    assert_eq!(run(&["--model", "wind.toml"]), named);
    assert!(columns(&named, &["x"])[5][0] > 0.3, "{named}");
    // Inverse dynamics of standing still gives the forces of the analysis.
    write("still.csv", "time,x,y,phi\n0,5,0,0\n10,5,0,0\n");
    done(&cdpr(at, &["inverse", "--model", "wind.toml", "--trajectory", "still.csv", "-o", "f.csv"]));
    done(&cdpr(at, &["analyse", "--model", "wind.toml", "--pose", "5,0,0", "--start", "hold.toml"]));
    let names: Vec<String> = (1..=4).map(|i| format!("winch_force[{i}]")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).chain(["disturbance_force_x"]).collect();
    let inverse = columns(&read("f.csv"), &names);
    done(&cdpr(at, &["simulate", "--model", "hold.toml", "--stop", "5", "--step", "1", "-o", "held.csv"]));
    let held = columns(&read("held.csv"), &names);
    for k in 0..5 {
        assert!((inverse[0][k] - held[0][k]).abs() < 1e-6 * held[0][k], "{inverse:?} {held:?}");
    }
    assert_eq!(inverse[0][4], 120.0);
    for row in columns(&read("held.csv"), &["x", "y", "phi"]) {
        assert!((row[0] - 5.0).abs() < 1e-6 && row[1].abs() < 1e-6 && row[2].abs() < 1e-8, "{row:?}");
    }
}

#[test]
fn a_pose_is_held_at_a_pretension_and_a_simulation_starts_at_rest_there() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let told = done(&cdpr(at, &["analyze", "--pose", "3,-2,0.05", "--pretension", "20000", "--start", "hold.toml"]));
    assert!(told.contains("hold.toml"), "{told}");
    done(&cdpr(at, &["simulate", "--model", "hold.toml", "--stop", "2", "--step", "1", "-o", "run.csv"]));
    let run = std::fs::read_to_string(at.join("run.csv")).unwrap();
    for row in columns(&run, &["x", "y", "phi", "tension[1]", "tension[2]", "tension[3]", "tension[4]"]) {
        for (value, expected) in row.iter().zip([3.0, -2.0, 0.05]) {
            assert!((value - expected).abs() < 1e-6, "{row:?}");
        }
        let mean: f64 = row[3..].iter().sum::<f64>() / 4.0;
        assert!((mean - 20e3).abs() < 200.0 && row[3..].iter().all(|t| (t - 20e3).abs() < 3e3), "{row:?}");
    }
    let far = cdpr(at, &["analyse", "--pose", "0,0,0", "--pretension", "0"]);
    assert_eq!(far.status.code(), Some(2));
}

#[test]
fn a_singular_pose_has_no_wrench_closure_and_tiny_damping_prints_as_zero() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let angles = "[-2.356, -0.785, 0.785, 2.356]";
    let model = format!("anchor_angle = {angles}\nattachment_angle = {angles}\n");
    std::fs::write(at.join("uncrossed.toml"), model).unwrap();
    let told = done(&cdpr(at, &["analyse", "--model", "uncrossed.toml", "--pose", "0,0,0"]));
    assert!(told.contains("wrench closure         no"), "{told}");
    // At 20 kN the slow modes are damped by -7e-9, which prints as the nothing that it is.
    let told = done(&cdpr(at, &["analyse", "--pose", "0,0,0", "--pretension", "20000"]));
    let modes = told.split("modes, winches holding their forces").nth(1).unwrap();
    for mode in modes.lines().skip(2).take(2) {
        assert_eq!(mode.split_whitespace().nth(1), Some("0"), "{mode}");
    }
    let modes = told.split("modes, winches locked").nth(1).unwrap();
    assert!(modes.lines().nth(2).unwrap().split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() > 1e-4, "{modes}");
}

#[test]
fn the_paper_is_written_with_its_claims() {
    let folder = tempfile::tempdir().unwrap();
    let told = done(&cdpr(folder.path(), &["paper", "--out", "paper"]));
    assert!(told.contains("does not hold"), "{told}");
    for name in ["claims.md", "fig8.svg", "fig8.png", "fig9.svg", "fig9.png", "inverse_dynamics.csv"] {
        assert!(folder.path().join("paper").join(name).exists(), "{name}");
    }
}
