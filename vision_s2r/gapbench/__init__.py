"""The sealed benchmark of diagnosis: recordings with a withheld answer, and a judge that opens the answers last.

Two halves that share nothing but the contract of recordings and reports: `seal` simulates machines with code of its
own and writes recordings and answers, `judge` runs the diagnosis on each recording as a process of its own and scores
its reports. Neither imports the simulators or the diagnosis of this project.
"""
