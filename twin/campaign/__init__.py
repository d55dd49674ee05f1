"""Blind campaigns: many hidden cases drawn, recorded and diagnosed, and one table of how well that went."""

from twin.campaign.calibration import RuleCalibration, calibrate
from twin.campaign.case import CasePlan, CaseResult, record_case, record_hidden, run_case
from twin.campaign.judgement import judge, named_first
from twin.campaign.plan import campaign_causes, fitting_causes, planned_cases
from twin.campaign.runner import read_results, run_campaign
from twin.campaign.summary import CampaignSummary, CauseRow, summarise
