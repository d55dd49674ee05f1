"""Examples of every command, shown at the end of its help."""

from collections.abc import Mapping

EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "demo": ("twin demo", "twin demo --seed 7 --cause added-mass --out demo"),
    "rig": (
        "twin rig show steel-lap-joint",
        "twin rig show my-rig.toml --picture my-rig.png --save my-rig.rrd",
        "twin rig import --mass beam.mas --stiffness beam.sti --nodes beam.inp --drive 0.1,0,0:+y --out beam.toml",
    ),
    "rehearse": (
        "twin rehearse steel-sweeps --rig steel-lap-joint --out rehearsal",
        "twin rehearse my-sweep.toml --rig my-rig.toml --preload 120N --preload 540N --out rehearsal",
    ),
    "serve": (
        "twin serve --rig steel-lap-joint --serial auto --instruments-out instruments.toml",
        "twin serve --rig my-rig.toml --tcp 127.0.0.1:5025 --can unixbus:/tmp/bus --speed fast",
        "twin serve --rig my-rig.toml --serial auto --fault flip:probability=0.001",
        "twin serve --commands",
    ),
    "acquire": (
        "twin acquire steel-sweeps --instruments instruments.toml --rig steel-lap-joint --out run.mcap",
        "twin acquire --instruments instruments.toml --seconds 10 --out background.mcap",
        "twin acquire steel-sweeps --instruments instruments.toml --rig steel-lap-joint --out run.mcap --view",
    ),
    "replay": ("twin replay run.mcap --serial auto --instruments-out instruments.toml",),
    "faults": ("twin faults --tries 20", "twin faults --only 'on the bus' --json"),
    "check": (
        "twin check run.mcap",
        "twin check random.mcap sweeps.mcap --rig steel-lap-joint",
        "twin check cut.mcap --recover whole.mcap",
    ),
    "import": (
        "twin import bench.csv --out run.mcap",
        "twin import force.wav response.wav --out run.mcap --mapping bench.toml",
    ),
    "convert": (
        "twin convert run.mcap run.uff",
        "twin convert analyser.uff run.mcap",
        "twin convert logged-on-the-bus.blf run.mcap",
        "twin convert random.mcap responses.uff --frf --resolution 0.05",
    ),
    "modes": (
        "twin modes random.mcap",
        "twin modes random.mcap --band 5 500 --out frequencies.csv --picture chart.png",
        "twin modes hits.mcap --rig hung-lap-joint --estimator Hv --report modes.html",
    ),
    "identify": (
        "twin identify random.mcap sweeps.mcap --rig steel-lap-joint --out model.toml",
        "twin identify response_control.csv --rig brake-reuss --out model.toml",
    ),
    "friction": ("twin friction 0lb.csv 30lb.csv 36lb.csv",),
    "predict": ("twin predict model.toml --drive drive.csv --out response.csv",),
    "couple": ("twin couple rig.toml --out coupled", "twin couple rig.toml --measured whole.uff --out identified"),
    "diagnose": (
        "twin diagnose random.mcap sweeps.mcap --held-out heldout.mcap --rig steel-lap-joint --out diagnosis",
        "twin diagnose later.mcap --rig diagnosis/extended.toml --out again",
        "twin diagnose frequencies.csv --rig composite-beam --out diagnosis",
        "twin diagnose response_control.csv --rig brake-reuss --out diagnosis",
    ),
    "campaign": (
        "twin campaign --out campaign --seeds 2",
        "twin campaign --out rigs --rig two-lap-joints --rig l-frame --seeds 2 --modes 2",
        "twin campaign --out weak --cause added-mass --cause joint-friction --strength 1 --strength 0.3",
        "twin campaign --out pairs --cause added-mass --cause channel-gain --pairs 30 --scheduler tcp://host:8786",
    ),
    "reproduce": ("twin reproduce", "twin reproduce steel-lap-joint --json"),
    "cite": ("twin cite", "twin cite diagnosis model.toml", "twin cite diagnosis --format cff"),
    "view": (
        "twin view sweeps.mcap",
        "twin view diagnosis --save diagnosis.rrd",
        "twin view diagnosis --picture diagnosis.png",
    ),
    "speed": ("twin speed", "twin speed --only streaming --only start --json", "twin speed --scaling --page speed.md"),
}
"""By command."""
