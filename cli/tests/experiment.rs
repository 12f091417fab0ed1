//! `cdpr experiment`: what it refuses, and a plan from end to end.

mod real;

use std::fs;

use real::{done, fails, folder};

const LIMITS: &str = "x = [-10, 10]\ny = [-10, 10]\nphi = [-0.05, 0.05]\nspeed = 1\nangular_speed = 0.02\n\
                      tension = [5000, 40000]\nduration = 30\ninterval = 0.1\n";
const MODEL: &str = "[[effect]]\nid = \"winch_force_gain\"\ncable = 2\nfactor = 0.004\n";
const CALL: [&str; 7] = ["experiment", "--from", "discovery.json", "--limits", "limits.toml", "-o", "plan.csv"];

/// A discovery of a gain of winch 2, with these rivals.
fn discovery(verdict: &str, rivals: &str) -> String {
    let channels =
        ["x", "y", "unstretched_length[1]", "unstretched_length[2]", "unstretched_length[3]", "unstretched_length[4]"];
    let channel = |name: &str, white: f64| {
        format!(r#""{name}": {{"white": {white}, "coloured": null, "time_constant": null, "drift": null}}"#)
    };
    let channels: Vec<String> = channels.iter().map(|name| channel(name, 2e-3)).chain([channel("phi", 5e-5)]).collect();
    format!(
        r#"{{"schema": 1, "verdict": "{verdict}", "terms": [], "effects": [{{"id": "winch_force_gain", "cable": 2,
        "parameters": {{"factor": {{"value": 0.004, "standard_error": 1e-5, "unit": "1"}}}}, "delta_bic": -900.0,
        "indistinguishable_from": [{rivals}]}}],
        "instruments": {{"channels": {{{}}}, "winch_force_error": null, "stamp_jitter": null}}}}"#,
        channels.join(",")
    )
}

fn rival(id: &str, cable: &str, parameters: &str) -> String {
    format!(r#"{{"id": "{id}", "cable": {cable}, "parameters": {{{parameters}}}, "delta_bic": 2.5}}"#)
}

fn bias() -> String {
    rival("winch_force_bias", "2", r#""bias": {"value": 80.0, "standard_error": null, "unit": "N"}"#)
}

fn refused(discovery: &str, limits: &str, model: &str, code: i32, words: &[&str]) {
    let files = [("discovery.json", discovery), ("limits.toml", limits), ("model.toml", model)];
    fails(&files, &CALL, code, words);
}

#[test]
fn a_plan_is_written_that_inverse_and_simulate_read() {
    let open = discovery("ambiguous", &bias());
    let folder = folder(&[("discovery.json", &open), ("limits.toml", LIMITS), ("model.toml", MODEL)]);
    let said = done(folder.path(), &CALL);
    assert!(said.contains("winch_force_gain on winch 2 against winch_force_bias on winch 2"), "{said}");
    assert!(said.contains("2.50") && said.contains("told apart") && said.contains("Written: plan.csv"), "{said}");
    let plan = fs::read_to_string(folder.path().join("plan.csv")).unwrap();
    assert!(plan.starts_with("time,x,y,phi,vx,vy,omega,ax,ay,alpha,winch_force[1],"), "{}", &plan[..200]);
    assert_eq!(plan.lines().count(), 302);
    done(folder.path(), &["inverse", "--model", "model.toml", "--trajectory", "plan.csv", "-o", "forces.csv"]);
    let run = ["simulate", "--model", "model.toml", "--input", "plan.csv", "--step", "0.1", "-o", "run.csv"];
    done(folder.path(), &run);
    let last = |name: &str| -> Vec<f64> {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        let names: Vec<String> = text.lines().next().unwrap().split(',').map(str::to_owned).collect();
        let row: Vec<f64> = text.lines().last().unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
        ["x", "y", "phi"].iter().map(|name| row[names.iter().position(|n| n == name).unwrap()]).collect()
    };
    let (asked, run) = (last("plan.csv"), last("run.csv"));
    assert!(asked.iter().zip(&run).all(|(a, b)| (a - b).abs() < 0.2), "{asked:?} {run:?}");
    // The same input gives the same plan.
    done(folder.path(), &CALL);
    assert_eq!(fs::read_to_string(folder.path().join("plan.csv")).unwrap(), plan);
}

#[test]
fn what_no_motion_tells_apart_is_said_and_nothing_is_written() {
    let other = rival("winch_force_gain", "2", r#""factor": {"value": 0.0041, "standard_error": null, "unit": "1"}"#);
    let words = ["no motion within these limits is expected to tell the explanations apart", "open", "tension"];
    refused(&discovery("ambiguous", &other), LIMITS, MODEL, 1, &words);
}

#[test]
fn bad_input_is_refused_with_what_to_do() {
    let open = discovery("ambiguous", &bias());
    refused(
        &discovery("named", ""),
        LIMITS,
        MODEL,
        2,
        &["discovery.json: the verdict is `named`", "an experiment is planned for the verdict `ambiguous`"],
    );
    refused("{}", LIMITS, MODEL, 2, &["discovery.json: missing field", "expected a discovery.json of `cdpr discover`"]);
    refused(&open, "speed = 1", MODEL, 2, &["limits.toml: line", "missing field `x`"]);
    refused(&open, &(LIMITS.to_owned() + "mass = 3\n"), MODEL, 2, &["limits.toml: line 9: unknown field `mass`"]);
    refused(&open, &LIMITS.replace("speed = 1", "speed = 0"), MODEL, 2, &["limits.toml: line 4: `speed` is 0"]);
    refused(&open, LIMITS, "", 2, &["discovery.json: found `winch_force_gain` with factor = 0.004", "model.toml"]);
    let away = format!("[start]\nx = 50.0\n{MODEL}");
    refused(&open, LIMITS, &away, 2, &["the model's start pose: x is 50", "write `start = [x, y, phi]`"]);
    let slack = LIMITS.replace("[5000, 40000]", "[5000, 5001]");
    refused(
        &open,
        &(slack + "start = [0, 0, 0.05]\n"),
        MODEL,
        2,
        &["at the start pose no tensions from 5000 to 5001 N"],
    );
    fails(&[("limits.toml", LIMITS)], &CALL, 2, &["discovery.json", "No such file"]);
}
