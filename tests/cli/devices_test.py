#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: `veduta devices` lists what there is, says which one works, and has a clear word where there
#   is none.
# Method: the command as a process, with this machine's drivers and with an empty folder of drivers.
# usage: tests/cli/devices_test.py VEDUTA VEDUTA_STREET
import json
import os
import subprocess

from city import VEDUTA, Case, ask, at, main, must


def without_drivers(*arguments):
    os.makedirs(at('no_drivers'), exist_ok=True)
    environment = dict(os.environ, OCL_ICD_VENDORS=at('no_drivers') + '/')
    done = subprocess.run([VEDUTA, 'devices', *arguments], capture_output=True, env=environment)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


class Devices(Case):
    def test_one_is_chosen_and_any_can_be(self):
        devices = ask('devices')['devices']
        self.assertEqual([d['index'] for d in devices], list(range(len(devices))))
        self.assertEqual(sum(d['chosen'] for d in devices), min(1, len(devices)))
        for d in devices:
            again = ask('devices', '--device', str(d['index']))['devices']
            self.assertEqual([e['index'] for e in again if e['chosen']], [d['index']])
            self.assertIn(d['name'], must('devices'))
            self.assertGreater(d['compute_units'], 0)
        kinds = [d['kind'] for d in devices]
        if 'gpu' in kinds:
            self.assertEqual([d['kind'] for d in devices if d['chosen']], ['gpu'])

    def test_none_is_chosen_for_cpp(self):
        self.assertFalse(any(d['chosen'] for d in ask('devices', '--device', 'cpp')['devices']))
        self.assertIn('C++ does the work', must('devices', '--device', 'cpp'))

    def test_a_missing_device_is_refused_by_name(self):
        code, out, err = without_drivers('--device', 'Voodoo')
        self.assertEqual((code, out), (1, ''))
        self.assertIn('there is no OpenCL device', err)
        if ask('devices')['devices']:
            self.refused(1, '"Voodoo"', 'devices', '--device', 'Voodoo')

    def test_without_drivers_there_is_a_word(self):
        code, out, err = without_drivers()
        self.assertEqual((code, err), (0, ''))
        self.assertIn('install a driver', out)
        code, out, err = without_drivers('--json')
        self.assertEqual((code, json.loads(out)), (0, {'devices': []}))


if __name__ == '__main__':
    main()
