//! Writes a report on made-up measurements, to look at the page without running a discovery.
//!
//! `cargo run -p cdpr-discovery --example sample_report -- out.html [named|ambiguous|partly_named|unnamed|no_missing_effect] [picture.svg]`
//!
//! The numbers are not a simulation of the plant: a platform on a multi-sine path, Coulomb friction on winch 3 that the
//! model does not have, and the error that this makes within each horizon, integrated by hand.

use std::f64::consts::TAU;
use std::fs;

use anyhow::{Context, Result, bail};
use cdpr_discovery::report::{
    Alternative, BeforeAfter, Block, Channel, ChannelGap, Effect, FileUsed, Gap, HorizonGap, Located, Method, NullTest,
    Parameter, Remainder, Report, ResidualMap, ResidualRow, Robot, Series, Setting, Signature, Span, Stability, Step,
    Term, Trial, Verdict, Whiteness, gap_picture, most_telling, render,
};

const FRICTION: f64 = 118.0; // N
const SPEED: f64 = 0.012; // m/s, transition speed
const MASS: f64 = 2760.0; // kg, platform with its share of the cables
const INERTIA: f64 = 3.5e5; // kg m²
const STEP: f64 = 0.2; // s
const BLOCK: f64 = 2.0; // s

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = arguments.first().context("wrong use: no output file; expected OUT.html [VERDICT] [PICTURE.svg]")?;
    let verdict = match arguments.get(1).map_or("named", String::as_str) {
        "named" => Verdict::Named,
        "ambiguous" => Verdict::Ambiguous,
        "partly_named" => Verdict::PartlyNamed,
        "unnamed" => Verdict::Unnamed,
        "no_missing_effect" => Verdict::NoMissingEffect,
        other => {
            bail!("unknown verdict `{other}`; expected named, ambiguous, partly_named, unnamed or no_missing_effect")
        }
    };
    let report = sample(verdict);
    fs::write(out, render(&report)?).with_context(|| format!("cannot write {out}"))?;
    if let Some(picture) = arguments.get(2) {
        let (trial, channel) = most_telling(&report).context("no trial to draw")?;
        fs::write(picture, gap_picture(&report, trial, channel)?).with_context(|| format!("cannot write {picture}"))?;
    }
    Ok(())
}

/// A report of the given verdict.
fn sample(verdict: Verdict) -> Report {
    let size = if verdict == Verdict::NoMissingEffect { 0.0 } else { FRICTION };
    let mut noise = Noise(7);
    let trials: Vec<Trial> =
        [("circle_20kN.csv", 100.0, false), ("sweep_20kN.csv", 100.0, false), ("check_run.csv", 60.0, true)]
            .into_iter()
            .enumerate()
            .map(|(i, (name, length, holdout))| trial(name, i as f64, length, holdout, size, 5.0, &mut noise))
            .collect();
    let channels = channels();
    let gap = gap(&channels, size, &mut noise);
    let mut report = Report {
        title: "spring campaign, platform at 20 kN pretension".to_owned(),
        verdict,
        effects: vec![friction()],
        not_shown: vec![],
        ended_early: false,
        changed: None,
        located: located(),
        terms: vec![],
        gap,
        channels,
        instruments: Vec::new(),
        remainder: Remainder { force: 1.9, torque: 14.0, force_before: Some(84.0), torque_before: Some(610.0) },
        trials,
        signatures: vec![signature(&mut noise)],
        robot: robot(),
        files: files(),
        settings: settings(),
        method: method(),
        limits: vec![],
        at_rest: false,
        remarks: vec![],
        corrected: false,
    };
    report.effects[0].holdout_gap_without = report.gap.holdout.map(|g| g.before);
    adapt(&mut report);
    report
}

/// Makes the report fit its verdict.
fn adapt(report: &mut Report) {
    match report.verdict {
        Verdict::Named => {}
        Verdict::Ambiguous => {
            let twin = &mut report.effects[0].alternatives[0];
            twin.indistinguishable = true;
            twin.delta_bic = 1.2;
            twin.correlation = Some(0.9994);
            report.remarks.push("Pretension stays within 3 % of 20 kN in all trials.".to_owned());
        }
        Verdict::PartlyNamed => {
            report
                .remarks
                .push("More is missing than was found: what is left over 5 s is 4.2 times the noise.".to_owned());
        }
        Verdict::Unnamed => {
            report.effects.clear();
            report.terms = vec![Term {
                target: "platform.force_x".to_owned(),
                expression: "-34.8*x*abs(y) + 12.3*sin(2.5*x)".to_owned(),
                standard_errors: vec![0.6, 0.4, 0.003],
                delta_bic: -241.0,
                holdout_gap_without: Some(report.gap.train.before),
                stability: Some(stability([0.74, 0.81, 0.93, 1.05, 1.19, 1.28])),
            }];
            report.method.null_test = Some(NullTest { runs: 99, allowed: 1, exceeded: Some(3), followed: Some(1) });
            report.located[0].place = "platform.force_x".to_owned();
            report.located[0].depends_on = vec!["position".to_owned()];
            report.signatures.clear();
        }
        Verdict::NoMissingEffect => {
            report.effects.clear();
            report.located.clear();
            report.signatures.clear();
            report.method.null_test = Some(NullTest { runs: 99, allowed: 1, exceeded: Some(42), followed: Some(0) });
            report.method.steps.retain(|s| s.outcome == "refused");
            report.remainder = Remainder { force: 0.8, torque: 5.2, force_before: Some(0.8), torque_before: Some(5.2) };
        }
    }
}

fn friction() -> Effect {
    let parameter = |name: &str, value: f64, error: Option<f64>, unit: &str| Parameter {
        name: name.to_owned(),
        value,
        standard_error: error,
        unit: unit.to_owned(),
    };
    Effect {
        id: "winch_coulomb_friction".to_owned(),
        label: "Coulomb friction".to_owned(),
        place: "winch[3]".to_owned(),
        cable: Some(3),
        named: true,
        equation: "F = 118.4 tanh(l̇/0.0123)".to_owned(),
        parameters: vec![
            parameter("force", 118.4, Some(1.3), "N"),
            parameter("transition_speed", 0.0123, Some(0.0008), "m/s"),
        ],
        given: vec![],
        delta_bic: -812.4,
        holdout_gap_without: Some(38.2),
        alternatives: vec![
            Alternative {
                id: "pulley_capstan_loss".to_owned(),
                label: "capstan loss".to_owned(),
                place: "winch[3]".to_owned(),
                cable: Some(3),
                parameters: vec![parameter("loss", 0.00591, Some(0.00007), "1")],
                delta_bic: 14.6,
                correlation: Some(0.997),
                indistinguishable: false,
                separate_by: "repeat the same path at 10 and 30 kN pretension".to_owned(),
            },
            Alternative {
                id: "winch_viscous_friction".to_owned(),
                label: "viscous friction".to_owned(),
                place: "winch[3]".to_owned(),
                cable: Some(3),
                parameters: vec![parameter("coefficient", 412.0, Some(9.0), "N s/m")],
                delta_bic: 233.0,
                correlation: Some(0.86),
                indistinguishable: false,
                separate_by: "repeat at half and at twice the speed".to_owned(),
            },
        ],
        stability: Some(stability([0.97, 1.02, 1.01, 0.98, 1.03, 0.99])),
    }
}

/// Three blocks in each of the first two trials.
fn stability(sizes: [f64; 6]) -> Stability {
    let chi_square = sizes.iter().map(|size| ((size - 1.0) / 0.03).powi(2)).sum();
    let constant = chi_square < 20.0;
    let block = |(k, size): (usize, f64)| Block {
        span: Span { trial: k / 3, start: 33.0 * (k % 3) as f64, end: 33.0 * (k % 3 + 1) as f64 },
        size,
        standard_error: 0.03,
    };
    Stability {
        blocks: sizes.into_iter().enumerate().map(block).collect(),
        chi_square,
        degrees: 5,
        p_value: if constant { 0.4 } else { 3e-8 },
        spread: if constant { 0.0 } else { 0.2 },
        constant,
    }
}

fn located() -> Vec<Located> {
    let span = |trial, start, end| Span { trial, start, end };
    vec![
        Located {
            place: "winch[3]".to_owned(),
            share_of_gap: 0.93,
            when: vec![],
            depends_on: vec!["speed".to_owned(), "direction".to_owned()],
        },
        Located {
            place: "cable[3]".to_owned(),
            share_of_gap: 0.04,
            when: vec![span(0, 12.0, 31.5), span(2, 20.0, 34.0)],
            depends_on: vec!["tension".to_owned()],
        },
    ]
}

fn channels() -> Vec<Channel> {
    let mut list = vec![("x".to_owned(), "m", 0.008), ("y".to_owned(), "m", 0.008), ("phi".to_owned(), "rad", 8e-4)];
    for (kind, noise) in [("cable_length", 0.004), ("unstretched_length", 0.003)] {
        list.extend((1..=4).map(|i| (format!("{kind}[{i}]"), "m", noise)));
    }
    list.into_iter()
        .enumerate()
        .map(|(i, (name, unit, noise))| Channel {
            name,
            unit: unit.to_owned(),
            noise,
            samples: 10_000 - 37 * i,
            whiteness: Some(Whiteness {
                name: "Ljung-Box Q(20)".to_owned(),
                statistic: 15.0 + 1.1 * i as f64,
                limit: 37.6,
                pass: true,
            }),
        })
        .collect()
}

/// Pose x (m), y (m), φ (rad) of trial `k` at `t`.
fn pose(k: f64, t: f64) -> [f64; 3] {
    let wave = |a: f64, period: f64, shift: f64| a * (TAU * (t / period + shift + 0.17 * k)).sin();
    [
        wave(2.4, 37.0, 0.0) + wave(0.9, 13.0, 0.3),
        wave(2.1, 41.0, 0.25) + wave(0.8, 11.0, 0.6),
        wave(0.02, 29.0, 0.1) + wave(0.01, 17.0, 0.4),
    ]
}

/// Anchor `i` and the cable's attachment at the given pose.
fn ends(i: usize, pose: [f64; 3]) -> ([f64; 2], [f64; 2]) {
    let anchor = [-135.0_f64, -45.0, 45.0, 135.0][i].to_radians();
    let body = [-45.0_f64, -135.0, 135.0, 45.0][i].to_radians() + pose[2];
    ([900.0 * anchor.cos(), 900.0 * anchor.sin()], [pose[0] + 10.0 * body.cos(), pose[1] + 10.0 * body.sin()])
}

fn length(i: usize, pose: [f64; 3]) -> f64 {
    let (a, b) = ends(i, pose);
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Reel-out speed of cable 3, m/s.
fn speed(k: f64, t: f64) -> f64 {
    (length(2, pose(k, t + 0.01)) - length(2, pose(k, t - 0.01))) / 0.02
}

/// The channels' values at a pose.
fn outputs(pose: [f64; 3]) -> Vec<f64> {
    let mut values = pose.to_vec();
    values.extend((0..4).map(|i| length(i, pose)));
    values.extend((0..4).map(|i| 0.99870 * length(i, pose)));
    values
}

fn trial(name: &str, k: f64, length_s: f64, holdout: bool, size: f64, horizon: f64, noise: &mut Noise) -> Trial {
    let channels = channels();
    let time: Vec<f64> = (0..(length_s / STEP) as usize).map(|i| i as f64 * STEP).collect();
    let mut series: Vec<Series> = channels
        .iter()
        .map(|c| Series { channel: c.name.clone(), measured: vec![], before: vec![], after: vec![], expected: c.noise })
        .collect();
    let mut drift = [Drift::default(), Drift::default()]; // before, after
    for t in &time {
        let restart = (t % horizon) < 0.5 * STEP;
        let truth = pose(k, *t);
        let true_outputs = outputs(truth);
        let force = size * (speed(k, *t) / SPEED).tanh();
        for (d, share) in drift.iter_mut().zip([1.0, 0.004]) {
            if restart {
                *d = Drift::default();
            }
            d.advance(share * force, truth);
        }
        for (c, s) in series.iter_mut().enumerate() {
            let sigma = channels[c].noise;
            let lost = holdout && c == 4 && (22.0..25.0).contains(t);
            s.measured.push(if lost { f64::NAN } else { true_outputs[c] + sigma * noise.normal() });
            for (d, into) in drift.iter().zip([&mut s.before, &mut s.after]) {
                let shifted = std::array::from_fn(|j| truth[j] + d.pose[j]);
                into.push(if restart { f64::NAN } else { outputs(shifted)[c] });
            }
        }
    }
    let residuals = residuals(&channels, &time, &series);
    Trial { name: name.to_owned(), holdout, time, series, residuals }
}

/// Error of the predicted pose since the last restart.
#[derive(Default)]
struct Drift {
    pose: [f64; 3],
    rate: [f64; 3],
}

impl Drift {
    /// One step under a missing pull of cable 3 by `force`.
    fn advance(&mut self, force: f64, pose: [f64; 3]) {
        let (a, b) = ends(2, pose);
        let l = length(2, pose);
        let s = [(b[0] - a[0]) / l, (b[1] - a[1]) / l];
        let arm = (b[0] - pose[0]) * s[1] - (b[1] - pose[1]) * s[0];
        let acceleration = [force * s[0] / MASS, force * s[1] / MASS, force * arm / INERTIA];
        for j in 0..3 {
            self.pose[j] += STEP * self.rate[j] + 0.5 * STEP * STEP * acceleration[j];
            self.rate[j] += STEP * acceleration[j];
        }
    }
}

fn residuals(channels: &[Channel], time: &[f64], series: &[Series]) -> ResidualMap {
    let per_block = (BLOCK / STEP).round() as usize;
    let blocks = time.len() / per_block;
    let edges = (0..=blocks).map(|b| b as f64 * BLOCK).collect();
    let rms = |predicted: &[f64], measured: &[f64], noise: f64| -> Vec<f64> {
        (0..blocks)
            .map(|b| {
                let range = b * per_block..(b + 1) * per_block;
                root_mean_square(&predicted[range.clone()], &measured[range], noise)
            })
            .collect()
    };
    let rows = channels
        .iter()
        .zip(series)
        .map(|(c, s)| ResidualRow {
            channel: c.name.clone(),
            before: rms(&s.before, &s.measured, c.noise),
            after: rms(&s.after, &s.measured, c.noise),
        })
        .collect();
    ResidualMap { edges, rows }
}

/// Of (predicted - measured)/noise where both are there; `NAN` where they never are.
fn root_mean_square(predicted: &[f64], measured: &[f64], noise: f64) -> f64 {
    let squares: Vec<f64> =
        predicted.iter().zip(measured).map(|(p, m)| ((p - m) / noise).powi(2)).filter(|v| v.is_finite()).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn gap(channels: &[Channel], size: f64, noise: &mut Noise) -> Gap {
    let mut both = |horizon: f64| -> (BeforeAfter, BeforeAfter, Vec<ChannelGap>) {
        let train = trial("", 0.0, 100.0, false, size, horizon, noise);
        let holdout = trial("", 2.0, 60.0, true, size, horizon, noise);
        let of = |t: &Trial, c: usize| BeforeAfter {
            before: root_mean_square(&t.series[c].before, &t.series[c].measured, channels[c].noise),
            after: root_mean_square(&t.series[c].after, &t.series[c].measured, channels[c].noise),
        };
        let list: Vec<ChannelGap> = channels
            .iter()
            .enumerate()
            .map(|(c, facts)| ChannelGap {
                channel: facts.name.clone(),
                train: of(&train, c),
                holdout: Some(of(&holdout, c)),
            })
            .collect();
        let mean = |pick: &dyn Fn(&ChannelGap) -> f64| {
            (list.iter().map(|g| pick(g).powi(2)).sum::<f64>() / list.len() as f64).sqrt()
        };
        let all = |pick: &dyn Fn(&ChannelGap) -> BeforeAfter| BeforeAfter {
            before: mean(&|g| pick(g).before),
            after: mean(&|g| pick(g).after),
        };
        (all(&|g| g.train), all(&|g| g.holdout.unwrap_or(g.train)), list)
    };
    let horizons = [1.0, 5.0, 20.0]
        .into_iter()
        .map(|horizon_s| {
            let (train, holdout, _) = both(horizon_s);
            HorizonGap { horizon_s, train, holdout: Some(holdout) }
        })
        .collect();
    let (train, holdout, list) = both(5.0);
    Gap {
        horizon_s: 5.0,
        train,
        holdout: Some(holdout),
        holdout_source: "trial check_run.csv".to_owned(),
        channels: list,
        horizons,
    }
}

fn signature(noise: &mut Noise) -> Signature {
    let points = (0..900)
        .map(|i| {
            let v = speed(0.0, 0.11 * f64::from(i));
            [v, FRICTION * (v / SPEED).tanh() + 24.0 * noise.normal()]
        })
        .collect();
    let law = (-200..=200)
        .map(|i| {
            let v = 0.0055 * f64::from(i);
            [v, 118.4 * (v / 0.0123).tanh()]
        })
        .collect();
    Signature {
        label: "Coulomb friction on winch 3".to_owned(),
        x_name: "reel-out speed 3".to_owned(),
        x_unit: "m/s".to_owned(),
        y_name: "missing pull at winch 3".to_owned(),
        y_unit: "N".to_owned(),
        points,
        law,
    }
}

fn robot() -> Robot {
    Robot {
        anchors: (0..4).map(|i| ends(i, [0.0; 3]).0).collect(),
        attachments: (0..4).map(|i| ends(i, [0.0; 3]).1).collect(),
        pose: [0.4, 0.3, 0.05],
        path: (0..200).map(|i| pose(0.0, 0.5 * f64::from(i))).map(|p| [p[0], p[1]]).collect(),
    }
}

fn files() -> Vec<FileUsed> {
    [
        ("training data", "data/circle_20kN.csv"),
        ("training data", "data/sweep_20kN.csv"),
        ("held-out data", "data/check_run.csv"),
        ("base model", "model.toml"),
        ("model with what was found", "found/model.toml"),
        ("FMU with what was found", "found/CablePlatform.fmu"),
        ("numbers behind the plots", "found/gap.csv"),
    ]
    .map(|(role, path)| FileUsed { role: role.to_owned(), path: path.to_owned() })
    .to_vec()
}

fn settings() -> Vec<Setting> {
    [("cable model", "lumped_mass"), ("horizon", "5 s"), ("seed", "1")]
        .map(|(name, value)| Setting { name: name.to_owned(), value: value.to_owned() })
        .to_vec()
}

fn method() -> Method {
    let step = |label: &str, outcome: &'static str, delta_bic: f64, reason: &str| Step {
        label: label.to_owned(),
        outcome,
        delta_bic: Some(delta_bic),
        reason: reason.to_owned(),
    };
    Method {
        candidates: 87,
        trials: 2,
        samples: 110_000,
        seconds: 14.2,
        null_test: Some(NullTest { runs: 99, allowed: 1, exceeded: Some(0), followed: Some(0) }),
        steps: vec![
            step("Coulomb friction on winch 3", "added", -812.4, "largest gain"),
            step("drum inertia on winch 3", "refused", -3.1, "no gain on held-out data"),
            step("linear drag on the platform", "refused", 6.4, "worse by BIC"),
        ],
    }
}

/// Reproducible Gaussian noise: a 64-bit linear congruential generator and the Box-Muller method.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}
