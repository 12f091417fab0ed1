//! The packed FMU in the importer `fmi` (fmi-rs), against the same simulation run in process.
//!
//! `CDPR_BIN` names the `cdpr` command; by default it is the release build of this checkout.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use fmi::fmi2::import::Fmi2Import;
use fmi::fmi2::instance::{CoSimulation, Common, InstanceCS};
use fmi::traits::{FmiImport, FmiStatus};

/// Communication step of the inputs and of the results, s.
const STEP: f64 = 0.01;

/// The command, in a folder of the test's own.
fn cdpr(folder: &Path, arguments: &[&str]) {
    let file = format!("../../target/release/cdpr{}", std::env::consts::EXE_SUFFIX);
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let command = std::env::var_os("CDPR_BIN").map_or(beside, PathBuf::from);
    let output = Command::new(&command)
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap_or_else(|error| panic!("{}: {error}", command.display()));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cdpr {}: {said}", arguments.join(" "));
}

/// The unpacked FMU and its variables' value references.
struct Fmu {
    import: Fmi2Import,
    references: HashMap<String, u32>,
}

impl Fmu {
    fn packed(folder: &Path) -> Self {
        cdpr(folder, &["fmu", "-o", "CablePlatform.fmu"]);
        let import: Fmi2Import = fmi::import::from_path(folder.join("CablePlatform.fmu")).unwrap();
        let variables = &import.model_description().model_variables.variables;
        let references = variables.iter().map(|v| (v.name.clone(), v.value_reference)).collect();
        Self { import, references }
    }

    fn references(&self, names: &[&str]) -> Vec<u32> {
        names.iter().map(|name| self.references[*name]).collect()
    }

    /// An instance after initialisation with these values.
    fn start(&self, values: &[(&str, f64)]) -> InstanceCS {
        let mut instance = self.import.instantiate_cs("plant", false, false).unwrap();
        instance.setup_experiment(None, 0.0, None).unwrap();
        instance.enter_initialization_mode().unwrap();
        self.set(&mut instance, values);
        instance.exit_initialization_mode().unwrap();
        instance
    }

    fn set(&self, instance: &mut InstanceCS, values: &[(&str, f64)]) {
        let (names, values): (Vec<&str>, Vec<f64>) = values.iter().copied().unzip();
        instance.set_real(&self.references(&names), &values).unwrap();
    }

    fn get(&self, instance: &mut InstanceCS, names: &[&str]) -> Vec<f64> {
        let mut values = vec![0.0; names.len()];
        instance.get_real(&self.references(names), &mut values).unwrap();
        values
    }
}

const FORCES: [&str; 4] = ["winch_force[1]", "winch_force[2]", "winch_force[3]", "winch_force[4]"];

/// All seven inputs at `time`: different forces that change, and a push.
fn inputs(time: f64) -> Vec<(&'static str, f64)> {
    let mut values: Vec<_> = FORCES
        .into_iter()
        .zip([0.0, 1.0, 2.0, 3.0])
        .map(|(name, i)| (name, 5000.0 + 300.0 * (0.7 * time + i).sin()))
        .collect();
    values.push(("disturbance_force_x", 200.0 * (0.4 * time).cos()));
    values.push(("disturbance_force_y", -100.0));
    values.push(("disturbance_torque", 50.0 * (0.9 * time).sin()));
    values
}

const OUTPUTS: [&str; 10] = [
    "x",
    "y",
    "phi",
    "vx",
    "omega",
    "cable_length[1]",
    "unstretched_length[2]",
    "tension[3]",
    "strain[4]",
    "cable_angle[1]",
];

/// Largest difference over largest magnitude.
fn relative_error(found: &[f64], expected: &[f64]) -> f64 {
    let largest = expected.iter().fold(0.0_f64, |max, value| max.max(value.abs()));
    let difference = found.iter().zip(expected).fold(0.0_f64, |max, (a, b)| max.max((a - b).abs()));
    difference / largest
}

#[test]
fn a_run_with_changing_inputs_is_the_one_in_process() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = Fmu::packed(folder.path());
    let steps = 300;

    let mut table = csv::Writer::from_path(folder.path().join("in.csv")).unwrap();
    let header = inputs(0.0).into_iter().map(|(name, _)| name);
    table.write_record(std::iter::once("time").chain(header)).unwrap();
    let times: Vec<f64> = (0..=steps).map(|k| f64::from(k) * STEP).collect();
    for &time in &times {
        let values = inputs(time).into_iter().map(|(_, value)| value);
        let row = std::iter::once(time).chain(values).map(|value| value.to_string());
        table.write_record(row).unwrap();
    }
    table.flush().unwrap();
    let stop = format!("{}", times[steps as usize]);
    cdpr(folder.path(), &["simulate", "--input", "in.csv", "--stop", &stop, "--step", "0.01", "-o", "out.csv"]);

    let mut expected = vec![Vec::new(); OUTPUTS.len()];
    let mut reader = csv::Reader::from_path(folder.path().join("out.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let columns = OUTPUTS.map(|name| header.iter().position(|found| found == name).unwrap());
    for row in reader.records() {
        let row = row.unwrap();
        for (series, &column) in expected.iter_mut().zip(&columns) {
            series.push(row[column].parse::<f64>().unwrap());
        }
    }

    let mut instance = fmu.start(&inputs(0.0));
    let mut found: Vec<Vec<f64>> = vec![Vec::new(); OUTPUTS.len()];
    for (k, &time) in times.iter().enumerate() {
        for (series, value) in found.iter_mut().zip(fmu.get(&mut instance, &OUTPUTS)) {
            series.push(value);
        }
        if k < steps as usize {
            fmu.set(&mut instance, &inputs(time));
            instance.do_step(time, STEP, true).unwrap();
        }
    }
    for ((name, found), expected) in OUTPUTS.iter().zip(&found).zip(&expected) {
        assert_eq!(found.len(), expected.len(), "{name}");
        let error = relative_error(found, expected);
        assert!(error < 1e-9, "{name}: relative error {error:e}");
    }
}

/// The release at rest from (0.1 m, 0.1 m, 0.1 rad) under 1 kN in each cable; numbers of an independent integrator
/// (Dormand-Prince 8(5,3) at 1e-12).
#[test]
fn the_release_agrees_with_an_independent_integrator() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = Fmu::packed(folder.path());
    let mut start = vec![("x", 0.1), ("y", 0.1), ("phi", 0.1)];
    start.extend(FORCES.map(|name| (name, 1000.0)));
    let mut instance = fmu.start(&start);
    let expected = [
        (1.0, [0.09996146395, 0.09995968337, 0.1000568557, 901.1359055, 1000.081074]),
        (5.0, [0.09903854427, 0.09899415739, 0.1014233341, 901.1481507, 1000.055707]),
        (20.0, [0.08498329362, 0.08430780395, 0.1235809352, 901.3476993, 1000.125725]),
    ];
    let mut step = 0;
    for (time, values) in expected {
        while f64::from(step) * STEP < time - 0.5 * STEP {
            instance.do_step(f64::from(step) * STEP, STEP, true).unwrap();
            step += 1;
        }
        let names = ["x", "y", "phi", "unstretched_length[1]", "tension[1]"];
        for ((name, found), expected) in names.iter().zip(fmu.get(&mut instance, &names)).zip(values) {
            let error = (found - expected).abs() / expected.abs();
            assert!(error < 1e-7, "{name} at {time} s: {found}, expected {expected}");
        }
    }
}

#[test]
fn a_restored_run_continues_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = Fmu::packed(folder.path());
    let mut instance = fmu.start(&inputs(0.0));
    let run = |instance: &mut InstanceCS, from: i32, to: i32| {
        for k in from..to {
            let time = f64::from(k) * STEP;
            fmu.set(instance, &inputs(time));
            instance.do_step(time, STEP, true).unwrap();
        }
        fmu.get(instance, &OUTPUTS)
    };
    run(&mut instance, 0, 50);
    let state = instance.get_fmu_state().unwrap();
    let bytes = instance.serialize_fmu_state(&state).unwrap();
    let straight = run(&mut instance, 50, 100);

    let mut other = fmu.start(&[]);
    let state = other.deserialize_fmu_state(&bytes).unwrap();
    other.set_fmu_state(&state).ok().unwrap();
    assert_eq!(run(&mut other, 50, 100), straight);
}
