"""The benchmark of diagnosis: recordings with a withheld answer, and scored with answers opened last.

Two halves that share nothing but the contract of recordings and reports: `generate` simulates machines with code of its
own and writes recordings and answers, `score` runs the diagnosis on each recording as a process of its own and scores
its reports. Neither imports the simulators or the diagnosis of this project.
"""
