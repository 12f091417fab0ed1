//! `cdpr calibrate` on recordings made here, and what it refuses.

mod real;

use std::fmt::Write as _;
use std::fs;

use real::{done, fails, folder};

/// Anchors and attachments of a robot of 4 m.
const ANCHORS: [[f64; 2]; 4] = [[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]];
const ATTACHMENTS: [[f64; 2]; 4] = [[-0.1, 0.1], [0.1, 0.1], [0.1, -0.1], [-0.1, -0.1]];

fn model() -> String {
    let mut text = "platform_mass = 20.0\nplatform_inertia = 0.8\ncable_model = \"rigid\"\n".to_owned();
    for (a, b) in ANCHORS.iter().zip(ATTACHMENTS) {
        let _ = writeln!(text, "[[cable]]\nanchor = {a:?}\nattachment = {b:?}");
    }
    text
}

/// A recording of the robot with its second anchor 12 mm further right, with these columns beside time and forces.
fn recording(columns: &[&str]) -> String {
    let mut text = "time,winch_force[1],winch_force[2],winch_force[3],winch_force[4]".to_owned();
    columns.iter().for_each(|c| text += &format!(",{c}"));
    text.push('\n');
    let mut state = 1_u64;
    for k in 0..400 {
        let t = f64::from(k) * 0.05;
        let pose = [0.8 * (0.9 * t).sin(), 0.6 * (1.3 * t).cos(), 0.4 * (1.7 * t).sin()];
        let (sin, cos) = pose[2].sin_cos();
        let _ = write!(text, "{t},100,100,100,100");
        for column in columns {
            let value = match *column {
                "x" => pose[0],
                "y" => pose[1],
                "phi" => pose[2],
                length => {
                    let i = length.trim_end_matches(']').chars().last().unwrap().to_digit(10).unwrap() as usize - 1;
                    let (a, b) = (ANCHORS[i], ATTACHMENTS[i]);
                    let moved = if i == 1 { 0.012 } else { 0.0 };
                    let apart =
                        [pose[0] + cos * b[0] - sin * b[1] - a[0] - moved, pose[1] + sin * b[0] + cos * b[1] - a[1]];
                    apart[0].hypot(apart[1])
                }
            };
            // Uniform noise, of the multiplier of P. L'Ecuyer, Mathematics of Computation 68 (1999), table 4.
            state = state.wrapping_mul(2_862_933_555_777_941_757).wrapping_add(1);
            let noise = 4e-4 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
            let _ = write!(text, ",{}", value + noise);
        }
        text.push('\n');
    }
    text
}

const ALL: [&str; 7] = ["x", "y", "phi", "cable_length[1]", "cable_length[2]", "cable_length[3]", "cable_length[4]"];

#[test]
fn a_moved_anchor_is_found_and_written_with_its_error() {
    let (model, data) = (model(), recording(&ALL));
    let folder = folder(&[("nominal.toml", &model), ("run.csv", &data)]);
    let said = done(folder.path(), &["calibrate", "--data", "run.csv", "--model", "nominal.toml", "-o", "new.toml"]);
    let row = |text: &str| text.lines().find(|l| l.contains("anchor[2].x")).map(str::to_owned).expect("a row");
    let text = fs::read_to_string(folder.path().join("new.toml")).unwrap();
    assert!(text.starts_with("# Geometry calibrated by run.csv"), "{text}");
    for row in [row(&said), row(&text)] {
        let numbers: Vec<f64> = row.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        assert!((numbers[1] - 12.0).abs() < 1.0 && numbers[2] < 1.0, "{row}");
    }
    assert!(said.contains("frame of the poses") && said.contains("Written: new.toml"), "{said}");
    done(folder.path(), &["model", "--check", "new.toml"]);
}

#[test]
fn what_cannot_be_calibrated_is_refused_and_nothing_is_written() {
    let (model, whole) = (model(), recording(&ALL));
    let (blind, loose) = (recording(&ALL[..3]), recording(&["x", "y", "cable_length[1]"]));
    let files = [("m.toml", model.as_str()), ("whole.csv", &whole), ("blind.csv", &blind), ("loose.csv", &loose)];
    let run = |data: &'static str| ["calibrate", "--data", data, "--model", "m.toml", "-o", "new.toml"];
    fails(&files, &run("blind.csv"), 2, &["blind.csv", "no length is measured", "cable_length[i]"]);
    fails(&files, &run("loose.csv"), 2, &["phi not measured, and no length is left over"]);
    fails(&files, &run("absent.csv"), 2, &["absent.csv"]);
    fails(&files, &["calibrate", "--data", "whole.csv", "--model", "m.toml"], 2, &["--output"]);
}
