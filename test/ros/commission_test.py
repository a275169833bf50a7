#!/usr/bin/env python3
"""commission.py at a terminal: it drives, writes its files, and any key stops it."""
import tempfile
from pathlib import Path

import rospy
import yaml

from tb3_labs.simulation.simulator_config import SimulatorConfig

from node_case import ZERO, NodeCase, run_as_node

#: Time from a key to the last command that moves the robot [s of the robot, 4 in a second].
PROMPT = 1.0


class CommissionTest(NodeCase):

    def begin(self, folder, steps):
        program = self.start('commission.py', '--steps', steps, '-o', folder, terminal=True)
        program.wait_for('Enter: begin.')
        program.type('')
        try:
            self.seen.wait_for('cmd_vel', lambda command: command != ZERO)
        except RuntimeError as problem:
            self.fail('{}; {}'.format(problem, program.text))
        return program

    def test_it_measures_and_writes(self):
        with tempfile.TemporaryDirectory() as folder:
            program = self.begin(folder, 'turns')
            program.wait_for('Its simulated twin: ')
            self.assertEqual(program.wait(), 0, program.text)
            self.assertRegex(program.text, r'ok +Lag of the motors +(9[3-9]|10[0-7])\.\d \+- ')
            chosen = yaml.safe_load((Path(folder) / 'robot.yaml').read_text())
            self.assertAlmostEqual(SimulatorConfig(**chosen).motor_lag, 0.1, delta=0.01)
            page = (Path(folder) / 'robot.html').read_text()
            self.assertIn('a turn differs by at most', page)
            self.assertIn('data:image/png', page)

    def test_a_number_that_is_not_possible_does_not_reach_the_files(self):
        with tempfile.TemporaryDirectory() as folder:
            program = self.begin(folder, 'rounds')
            for number, typed in enumerate(('nan', '9999', '5'), start=1):
                program.wait_for('By how many degrees', times=number)
                program.type(typed)
            self.assertEqual(program.wait(30.0), 0, program.text)
            for wrong in ('nan', '9999'):
                self.assertIn("'{}' is not valid: type a number from -360 to 360".format(wrong),
                              program.text)
            chosen = yaml.safe_load((Path(folder) / 'robot.yaml').read_text())
            self.assertAlmostEqual(SimulatorConfig(**chosen).wheel_separation, 0.16, delta=0.001)

    def test_any_key_stops_it(self):
        with tempfile.TemporaryDirectory() as folder:
            program = self.begin(folder, 'fast drives')
            pressed = rospy.get_time()
            program.type('x')
            self.seen.wait_for('cmd_vel', lambda command: command == ZERO)
            self.seen.wait_for_rest('ground_truth')
            program.wait_for('a key was pressed')
            self.assertEqual(program.wait(), 0, program.text)
            self.assertEqual(self.seen.latest('cmd_vel'), ZERO)
            self.assertEqual([command for _, command in self.seen.all('cmd_vel', pressed + PROMPT)
                              if command != ZERO], [])


if __name__ == '__main__':
    run_as_node('commission', CommissionTest)
