//! Pictures of runs: panels over a common time axis, written as SVG.

mod axis;
mod recording;
mod svg;

pub(crate) use recording::{Channel, Recording};

/// Panels below each other, over one time axis.
pub(crate) struct Figure {
    pub(crate) title: String,
    /// A sentence below the title; may be empty.
    pub(crate) note: String,
    pub(crate) panels: Vec<Panel>,
}

/// Lines and marks with one vertical axis.
pub(crate) struct Panel {
    /// Quantity and unit, such as `tension (kN)`.
    pub(crate) title: String,
    pub(crate) lines: Vec<Line>,
    pub(crate) scale: Scale,
}

/// How values are laid along the vertical axis.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// In proportion.
    Linear,
    /// By powers of ten; values of zero and below are left out.
    Logarithmic,
}

/// One quantity over time.
pub(crate) struct Line {
    /// Written at its end.
    pub(crate) name: String,
    /// Time (s) and value.
    pub(crate) points: Vec<[f64; 2]>,
    /// Which colour; lines that belong together share one.
    pub(crate) colour: usize,
    pub(crate) style: Style,
}

/// How points are shown.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// Joined by a line.
    Joined,
    /// Held from each point to the next.
    Held,
    /// Small rings.
    Rings,
}

impl Figure {
    /// The picture as the text of an SVG file.
    pub(crate) fn to_svg(&self) -> String {
        svg::draw(self)
    }
}

/// The picture of a simulation.
pub(crate) fn run_picture(title: &str, recording: &Recording) -> Figure {
    let mut panels = motion_panels(recording);
    let forces: Vec<Channel> = (0..recording.cables()).map(Channel::WinchForce).collect();
    panels.push(cable_panel("winch force", recording, &forces, Style::Held));
    let tensions: Vec<Channel> = (0..recording.cables()).map(Channel::Tension).collect();
    panels.push(cable_panel("tension", recording, &tensions, Style::Joined));
    let lines = (0..recording.cables()).map(|i| {
        let mut points = recording.points(Channel::UnstretchedLength(i));
        let start = points.first().map_or(0.0, |p| p[1]);
        points.iter_mut().for_each(|p| p[1] -= start);
        Line { name: format!("cable {}", i + 1), points, colour: i, style: Style::Joined }
    });
    panels.push(Panel {
        title: "cable paid out since the start (m)".into(),
        lines: lines.collect(),
        scale: Scale::Linear,
    });
    let disturbed = |k: usize| recording.points(Channel::Disturbance(k)).iter().any(|p| p[1] != 0.0);
    if disturbed(0) || disturbed(1) {
        let channels = [(Channel::Disturbance(0), "along x"), (Channel::Disturbance(1), "along y")];
        panels.push(panel("disturbance force (N)", recording, &channels, Style::Held, 1.0));
    }
    if disturbed(2) {
        let channels = [(Channel::Disturbance(2), "torque")];
        panels.push(panel("disturbance torque (N m)", recording, &channels, Style::Held, 1.0));
    }
    Figure { title: title.to_owned(), note: String::new(), panels }
}

/// Position and orientation.
pub(crate) fn motion_panels(recording: &Recording) -> Vec<Panel> {
    let position = [(Channel::Pose(0), "x"), (Channel::Pose(1), "y")];
    vec![
        panel("position (m)", recording, &position, Style::Joined, 1.0),
        panel(
            "orientation (degrees)",
            recording,
            &[(Channel::Pose(2), "φ")],
            Style::Joined,
            180.0 / std::f64::consts::PI,
        ),
    ]
}

/// One line for each cable, in N or kN.
pub(crate) fn cable_panel(quantity: &str, recording: &Recording, channels: &[Channel], style: Style) -> Panel {
    let largest = channels.iter().flat_map(|c| recording.points(*c)).fold(0.0_f64, |a, p| a.max(p[1].abs()));
    let (unit, factor) = if largest >= 5000.0 { ("kN", 1e-3) } else { ("N", 1.0) };
    let names: Vec<String> = (1..=channels.len()).map(|i| format!("cable {i}")).collect();
    let named: Vec<(Channel, &str)> = channels.iter().copied().zip(names.iter().map(String::as_str)).collect();
    panel(&format!("{quantity} ({unit})"), recording, &named, style, factor)
}

fn panel(title: &str, recording: &Recording, channels: &[(Channel, &str)], style: Style, factor: f64) -> Panel {
    let lines = channels.iter().enumerate().map(|(colour, (channel, name))| {
        let mut points = recording.points(*channel);
        points.iter_mut().for_each(|p| p[1] *= factor);
        Line { name: (*name).to_owned(), points, colour, style }
    });
    Panel { title: title.to_owned(), lines: lines.collect(), scale: Scale::Linear }
}
