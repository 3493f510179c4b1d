"""What Mesa's RADV makes of SPIR-V, for a GPU that need not be there.

    python -m lobe.lab.radv NAVI21 VERTEX.spv < paths

A process of its own for each GPU, since the driver reads only once which GPU to play. Reads the paths of fragment or
compute shaders in SPIR-V, a line each; prints the driver's name, then the statistics of each shader, as lines of JSON.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

MOST_INPUTS = 16  # vec4 attributes of a vertex, of which the vertex shader makes the fragment shader's inputs
ICDS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d")


def manifests() -> list[Path]:
    """The files by which Vulkan's loader finds RADV; none where it is not installed."""
    return sorted(path for folder in ICDS for path in Path(folder).glob("radeon_icd*.json"))


class Compiler:
    """Makes pipelines only for the statistics of their fragment or compute shader.

    Each struct has a name of its own while a call uses it: the binding frees what a nested temporary points to.
    """

    def __init__(self, gpu: str, vertex: bytes):
        os.environ["RADV_FORCE_FAMILY"] = gpu
        os.environ["VK_ICD_FILENAMES"] = os.environ["VK_DRIVER_FILES"] = ":".join(map(str, manifests()))
        os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
        import vulkan as vk

        self.vk = vk
        application = vk.VkApplicationInfo(apiVersion=vk.VK_MAKE_VERSION(1, 1, 0))
        wanted = vk.VkInstanceCreateInfo(pApplicationInfo=application)
        self.instance = vk.vkCreateInstance(wanted, None)
        physical = vk.vkEnumeratePhysicalDevices(self.instance)[0]
        properties = vk.vkGetPhysicalDeviceProperties(physical)
        version = properties.driverVersion
        self.driver = {"device": properties.deviceName,
                       "mesa": f"{version >> 22}.{version >> 12 & 1023}.{version & 4095}"}
        queues = [vk.VkDeviceQueueCreateInfo(queueFamilyIndex=0, pQueuePriorities=[1.0])]
        feature = vk.VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR(pipelineExecutableInfo=True)
        wanted = vk.VkDeviceCreateInfo(pNext=feature, pQueueCreateInfos=queues,
                                       ppEnabledExtensionNames=["VK_KHR_pipeline_executable_properties"])
        self.device = vk.vkCreateDevice(physical, wanted, None)
        self._executables = vk.vkGetDeviceProcAddr(self.device, "vkGetPipelineExecutablePropertiesKHR")
        self._statistics = vk.vkGetDeviceProcAddr(self.device, "vkGetPipelineExecutableStatisticsKHR")
        self.vertex = self._module(vertex)
        self.layout = self._layout()
        self.render_pass = self._render_pass()

    def statistics(self, code: bytes, is_compute: bool) -> dict[str, int]:
        """The driver's figures of a shader, by the driver's names."""
        vk = self.vk
        module = self._module(code)
        pipeline = self._compute(module) if is_compute else self._graphics(module)
        stage = vk.VK_SHADER_STAGE_COMPUTE_BIT if is_compute else vk.VK_SHADER_STAGE_FRAGMENT_BIT
        made = vk.VkPipelineInfoKHR(pipeline=pipeline)
        index = next(i for i, part in enumerate(self._executables(self.device, made)) if part.stages & stage)
        asked = vk.VkPipelineExecutableInfoKHR(pipeline=pipeline, executableIndex=index)
        found = {s.name: s.value.u64 for s in self._statistics(self.device, asked)}
        vk.vkDestroyPipeline(self.device, pipeline, None)
        vk.vkDestroyShaderModule(self.device, module, None)
        return found

    def _module(self, code: bytes):
        wanted = self.vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code)
        return self.vk.vkCreateShaderModule(self.device, wanted, None)

    def _stage(self, stage: int, module):
        return self.vk.VkPipelineShaderStageCreateInfo(stage=stage, module=module, pName="main")

    def _layout(self):
        vk = self.vk
        buffers = [vk.VkDescriptorSetLayoutBinding(i, vk.VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1,
                                                   vk.VK_SHADER_STAGE_COMPUTE_BIT) for i in range(2)]
        wanted = vk.VkDescriptorSetLayoutCreateInfo(pBindings=buffers)
        sets = [vk.vkCreateDescriptorSetLayout(self.device, wanted, None)]
        wanted = vk.VkPipelineLayoutCreateInfo(pSetLayouts=sets)
        return vk.vkCreatePipelineLayout(self.device, wanted, None)

    def _render_pass(self):
        vk = self.vk
        targets = [vk.VkAttachmentDescription(
            format=vk.VK_FORMAT_R32G32B32A32_SFLOAT, samples=vk.VK_SAMPLE_COUNT_1_BIT,
            loadOp=vk.VK_ATTACHMENT_LOAD_OP_DONT_CARE, storeOp=vk.VK_ATTACHMENT_STORE_OP_STORE,
            initialLayout=vk.VK_IMAGE_LAYOUT_UNDEFINED, finalLayout=vk.VK_IMAGE_LAYOUT_GENERAL)]
        colours = [vk.VkAttachmentReference(attachment=0, layout=vk.VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL)]
        passes = [vk.VkSubpassDescription(pipelineBindPoint=vk.VK_PIPELINE_BIND_POINT_GRAPHICS,
                                          pColorAttachments=colours)]
        wanted = vk.VkRenderPassCreateInfo(pAttachments=targets, pSubpasses=passes)
        return vk.vkCreateRenderPass(self.device, wanted, None)

    def _compute(self, module):
        vk = self.vk
        stage = self._stage(vk.VK_SHADER_STAGE_COMPUTE_BIT, module)
        wanted = [vk.VkComputePipelineCreateInfo(flags=vk.VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR, stage=stage,
                                                 layout=self.layout)]
        return vk.vkCreateComputePipelines(self.device, vk.VK_NULL_HANDLE, 1, wanted, None)[0]

    def _graphics(self, module):
        vk = self.vk
        stages = [self._stage(vk.VK_SHADER_STAGE_VERTEX_BIT, self.vertex),
                  self._stage(vk.VK_SHADER_STAGE_FRAGMENT_BIT, module)]
        bindings = [vk.VkVertexInputBindingDescription(0, 16 * MOST_INPUTS, vk.VK_VERTEX_INPUT_RATE_VERTEX)]
        attributes = [vk.VkVertexInputAttributeDescription(i, 0, vk.VK_FORMAT_R32G32B32A32_SFLOAT, 16 * i)
                      for i in range(MOST_INPUTS)]
        vertices = vk.VkPipelineVertexInputStateCreateInfo(pVertexBindingDescriptions=bindings,
                                                           pVertexAttributeDescriptions=attributes)
        assembly = vk.VkPipelineInputAssemblyStateCreateInfo(topology=vk.VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST)
        viewports = [vk.VkViewport(0, 0, 64, 64, 0, 1)]
        scissors = [vk.VkRect2D(vk.VkOffset2D(0, 0), vk.VkExtent2D(64, 64))]
        viewport = vk.VkPipelineViewportStateCreateInfo(pViewports=viewports, pScissors=scissors)
        raster = vk.VkPipelineRasterizationStateCreateInfo(lineWidth=1.0)
        samples = vk.VkPipelineMultisampleStateCreateInfo(rasterizationSamples=vk.VK_SAMPLE_COUNT_1_BIT)
        targets = [vk.VkPipelineColorBlendAttachmentState(colorWriteMask=0xF)]  # r, g, b, a
        blend = vk.VkPipelineColorBlendStateCreateInfo(pAttachments=targets)
        wanted = [vk.VkGraphicsPipelineCreateInfo(
            flags=vk.VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR, pStages=stages, pVertexInputState=vertices,
            pInputAssemblyState=assembly, pViewportState=viewport, pRasterizationState=raster,
            pMultisampleState=samples, pColorBlendState=blend, layout=self.layout, renderPass=self.render_pass)]
        return vk.vkCreateGraphicsPipelines(self.device, vk.VK_NULL_HANDLE, 1, wanted, None)[0]


def main() -> None:
    compiler = Compiler(sys.argv[1], Path(sys.argv[2]).read_bytes())
    print(json.dumps(compiler.driver))
    for line in sys.stdin:
        path = Path(line.rstrip("\n"))
        print(json.dumps(compiler.statistics(path.read_bytes(), ".comp" in path.suffixes)))


if __name__ == "__main__":
    main()
