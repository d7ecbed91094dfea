% SPDX-License-Identifier: Apache-2.0
% Reads channels that `rfgs-factory convert data --to mat --out mat` wrote, and says how far the
% echo of the moving person is at each frame. For MATLAB and GNU Octave:
%
%   file = 'mat/wifi.mat'; run('read_in_matlab.m')
%
% csi: (time, tx, rx, subcarrier), complex single; csi_static: the same without anything that moves.
% Names, axes and units are those of docs/dataset.md: metres, seconds, hertz.
if ~exist('file', 'var'), file = 'mat/wifi.mat'; end
data = load(file);
light_m_s = 299792458;

moving = double(data.csi) - double(data.csi_static);
[times, senders, receivers, subcarriers] = size(moving);

% Delay profile: mean power over links of the inverse Fourier transform along the band. The window
% (Hann) keeps strong echoes from hiding weak ones behind their side lobes.
window = 0.5 - 0.5 * cos(2 * pi * (0.5:subcarriers - 0.5) / subcarriers);
points = 8 * subcarriers;
profile = ifft(moving .* reshape(window, 1, 1, 1, []), points, 4);
profile = reshape(mean(mean(abs(profile) .^ 2, 2), 3), times, points);
spacing_hz = mean(diff(data.freq_hz(:)));
path_m = light_m_s * (0:points - 1) / (points * spacing_hz);

[~, strongest] = max(profile, [], 2);
for row = 1:times
  fprintf('time %.3f s: strongest moving echo after %.2f m of path\n', ...
          data.time_s(row), path_m(strongest(row)));
end
if isfield(data, 'joints_m')
  pelvis = data.joints_m(1, 1, 1, :);
  fprintf('pelvis of the first person at the first frame: %.3f %.3f %.3f m\n', pelvis);
end
