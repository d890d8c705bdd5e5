"""The commands of `ghest-rt study`; each is in a file of its own and imports what it needs when it runs."""

from ghest_rt.cli.plain import PlainTyper
from ghest_rt.cli.study.accuracy import accuracy
from ghest_rt.cli.study.compare import compare
from ghest_rt.cli.study.latency import latency
from ghest_rt.cli.study.report import report
from ghest_rt.cli.study.sensitivity import sensitivity

app = PlainTyper(
    name="study",
    no_args_is_help=True,
    help="Make the evaluation's tables and figures from nothing, the paper's values beside (needs the extra 'study').",
)
app.command()(accuracy)
app.command()(sensitivity)
app.command()(compare)
app.command()(latency)
app.command()(report)
