//! A model as the text of a `model.toml`.

use std::fmt::Write as _;

use super::Model;
use crate::parameter::comment;
use crate::parameters::Initialization;
use crate::per_cable::PerCable;
use crate::signal::{DISTURBANCES, Signal};
use crate::winch::WinchCommand;

impl Model {
    /// The text of a `model.toml` that reads back as this model, with every unit in a comment.
    pub fn to_toml(&self) -> String {
        let p = &self.parameters;
        let mut out = String::from("# A planar cable-driven parallel robot. SI units, radians.\n\n");
        let mut line = |key: &str, value: String, comment: &str| {
            let _ = writeln!(out, "{:<48} # {comment}", format!("{key} = {value}"));
        };
        let name = |value: String| format!("{:?}", snake_case(&value));
        let array = |values: PerCable<f64>| format!("{values:?}");
        line("cable_model", name(format!("{:?}", p.cable_model)), "rigid, massless_spring or lumped_mass");
        line("cable_inertia", name(format!("{:?}", p.cable_inertia)), "paper, reeled or none");
        line("cable_damper", name(format!("{:?}", p.cable_damper)), "length_rate (as the paper has it) or strain_rate");
        line("platform_mass", format!("{:?}", p.platform_mass), &comment("platform_mass"));
        line("platform_inertia", format!("{:?}", p.platform_inertia), &comment("platform_inertia"));
        line("centre_of_mass", format!("{:?}", p.centre_of_mass), "m, body frame");
        line("gravity", format!("{:?}", p.gravity), "m/s2, on the platform");
        if p.cable.is_empty() {
            line("anchor_radius", format!("{:?}", p.anchor_radius), &comment("anchor_radius"));
            line("attachment_radius", format!("{:?}", p.attachment_radius), &comment("attachment_radius"));
            line("anchor_angle", array(p.anchor_angle), &comment("anchor_angle"));
            line("attachment_angle", array(p.attachment_angle), &comment("attachment_angle"));
        }
        for (key, value) in [
            ("cable_density", p.cable_density),
            ("youngs_modulus", p.youngs_modulus),
            ("cable_area", p.cable_area),
            ("cable_damping", p.cable_damping),
            ("relative_tolerance", self.relative_tolerance),
        ] {
            line(key, format!("{value:?}"), &comment(key));
        }
        let choices = "radau (implicit), dormand_prince (explicit) or auto (the cheaper one)";
        line("solver", name(format!("{:?}", self.solver)), choices);
        let s = &self.start;
        let initialization = name(format!("{:?}", s.initialization));
        line("initialization", initialization, "from_winch_forces, from_states or static_equilibrium");
        out.push_str("\n[start]\n");
        let mut line = |key: &str, value: String, comment: &str| {
            let _ = writeln!(out, "{:<48} # {comment}", format!("{key} = {value}"));
        };
        for (k, value) in s.pose.into_iter().enumerate() {
            line(&Signal::Pose(k).name(), format!("{value:?}"), Signal::Pose(k).unit());
        }
        for (k, value) in s.twist.into_iter().enumerate() {
            line(&Signal::Twist(k).name(), format!("{value:?}"), Signal::Twist(k).unit());
        }
        // Read under from_states only: elsewhere they stand as comments.
        let given = if s.initialization == Initialization::FromStates { "" } else { "# " };
        for (key, values, comment) in [
            ("unstretched_length", s.unstretched_length, "m, paid out; for from_states"),
            ("unstretched_length_rate", s.unstretched_length_rate, "m/s; for from_states"),
        ] {
            line(&format!("{given}{key}"), array(values), comment);
        }
        let meaning = match p.winch.command {
            WinchCommand::Force => "N, pull-positive, held until an input says otherwise",
            WinchCommand::Torque => "N m, pull-positive, held until an input says otherwise",
            WinchCommand::Speed => "m/s, paying out, held until an input says otherwise",
            WinchCommand::Length => "m, paid out, held until an input says otherwise",
        };
        line(p.winch.command.input(), array(s.inputs.winch_force), meaning);
        for (facts, value) in DISTURBANCES.iter().zip(s.inputs.disturbance) {
            line(facts.name, format!("{value:?}"), &facts.unit.replace('.', " "));
        }
        out.push_str("\n[winch]\n");
        let mut line = |key: &str, value: String, comment: &str| {
            let _ = writeln!(out, "{:<48} # {comment}", format!("{key} = {value}"));
        };
        line("command", format!("{:?}", p.winch.command.name()), "force, torque, speed or length");
        let (given, inertia) = p.winch.rotor_inertia.map_or(("# ", 0.0), |inertia| ("", inertia));
        line(&format!("{given}rotor_inertia"), format!("{inertia:?}"), &comment("rotor_inertia"));
        for (key, value, name) in [
            ("drum_radius", p.winch.drum_radius, "drum_radius"),
            ("gear_ratio", p.winch.gear_ratio, "gear_ratio"),
            ("bandwidth", p.winch.bandwidth, "winch_bandwidth"),
            ("damping", p.winch.damping, "winch_damping"),
            ("force_limit", p.winch.force_limit, "winch_force_limit"),
        ] {
            line(key, format!("{value:?}"), &comment(name));
        }
        for (i, cable) in p.cable.iter().enumerate() {
            let _ = writeln!(out, "\n[[cable]] # {}", i + 1);
            let mut line = |key: &str, value: String, comment: &str| {
                let _ = writeln!(out, "{:<48} # {comment}", format!("{key} = {value}"));
            };
            line("anchor", format!("{:?}", cable.anchor), "m, fixed frame");
            line("attachment", format!("{:?}", cable.attachment), "m, body frame");
            let own = [
                ("youngs_modulus", cable.youngs_modulus),
                ("area", cable.area),
                ("density", cable.density),
                ("damping", cable.damping),
                ("drum_radius", cable.drum_radius),
                ("gear_ratio", cable.gear_ratio),
                ("rotor_inertia", cable.rotor_inertia),
            ];
            for (key, value) in own {
                if let Some(value) = value {
                    line(key, format!("{value:?}"), &comment(&format!("own_{key}")));
                }
            }
        }
        for effect in &self.effects {
            let info = effect.info().ok();
            let _ = writeln!(out, "\n[[effect]] # {}", info.map_or("", |i| i.title));
            let mut line = |key: &str, value: String, comment: &str| {
                let text = format!("{key} = {value}");
                let _ =
                    if comment.is_empty() { writeln!(out, "{text}") } else { writeln!(out, "{text:<48} # {comment}") };
            };
            line("id", format!("{:?}", effect.id), "");
            if let Some(cable) = effect.cable {
                line("cable", cable.to_string(), "");
            }
            for (key, time, comment) in
                [("from", effect.from, "s, when it begins"), ("until", effect.until, "s, when it ends")]
            {
                if let Some(time) = time {
                    line(key, format!("{time:?}"), comment);
                }
            }
            for (key, value) in
                [("channel", &effect.channel), ("target", &effect.target), ("expression", &effect.expression)]
            {
                if let Some(value) = value {
                    line(key, toml::Value::String(value.clone()).to_string(), "");
                }
            }
            for (parameter, value) in info.map_or(&[][..], |i| i.parameters).iter().zip(&effect.values) {
                line(parameter.name, format!("{value:?}"), &format!("{}, {}", parameter.unit, parameter.description));
            }
        }
        out
    }
}

fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}
